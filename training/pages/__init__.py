"""Pages of HTML: one file each, which need no network."""
