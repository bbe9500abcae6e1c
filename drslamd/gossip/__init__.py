"""What is said to the team, by whom, and again when it was lost."""
