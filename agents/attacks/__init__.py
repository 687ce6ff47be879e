"""Scripted attacks, one file per family."""
