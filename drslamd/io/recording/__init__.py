"""A recording on the disk: its files, what they say of their origin, who writes them."""
