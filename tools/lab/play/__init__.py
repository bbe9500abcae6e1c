"""Recordings played to the team: emulated hardware, virtual time, real processes."""
