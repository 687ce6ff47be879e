"""The multi-target tracker: prediction, gating, assignment, update, track score, the store of tracks."""
