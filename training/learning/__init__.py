"""Learning: the batched world as an environment of learners, and training in it."""

import os

# Threads of torch that wait in a loop for each other are twenty times slower when another process needs their
# core. It reads this when it is first imported.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
