"""What a robot knows, as plain dictionaries for whoever asks, and as text and tables of them."""
