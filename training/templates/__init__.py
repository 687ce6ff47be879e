"""What `trust-env new` writes: a defense, an attack and a scenario that run, to be changed.

The classes here are complete; in a new file they get the name that is asked for.
"""
