"""Studies behind defaults: what was tried, and the commands that try it again."""
