"""What a robot knows of clocks and graph, as plain dictionaries for whoever asks."""
