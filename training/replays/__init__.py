"""Episodes played again, to look at: as a page that plays them, or as a moving image."""
