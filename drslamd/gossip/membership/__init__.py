"""Who belongs to the team: who has answered this start, and what was turned away."""
