"""Attacks played against defenses, and what came of it."""
