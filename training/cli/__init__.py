"""The program `trust-env`, one file per command."""
