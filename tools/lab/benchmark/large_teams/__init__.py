"""What teams cost of which most pairs have met."""
