"""What players do and see: the tables of actions, observations and the global state."""
