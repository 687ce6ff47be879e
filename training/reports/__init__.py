"""Reports: what runs have found, as a page to look at."""
