"""Trained policies as files of weights, evaluated in plain NumPy."""
