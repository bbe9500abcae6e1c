"""What is said again of the logs: by whom, when, and how much of it in a second."""
