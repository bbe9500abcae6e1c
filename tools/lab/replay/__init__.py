"""Recordings of real robots: read, replayed to the bit, played again with another configuration."""
