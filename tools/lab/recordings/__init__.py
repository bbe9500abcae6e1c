"""What a team recorded, who reads which file, and simulated worlds that look the same."""
