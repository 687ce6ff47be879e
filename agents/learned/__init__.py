"""Trained policies as files of weights, played in plain NumPy."""
