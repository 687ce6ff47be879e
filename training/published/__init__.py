"""The tables that the documentation shows, each made by one command of `trust-env`."""
