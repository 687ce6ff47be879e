"""Learning: the batched world as an environment of learners, and training in it."""
