"""Learning: the batched world as an environment of learners, and training in it."""

import os

# Torch's threads are twenty times slower if they wait in a busy loop while another process needs their core.
# Torch reads this when it is first imported.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
