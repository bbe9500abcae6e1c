"""Until one answer stands: where a peer may be, and which motion would decide.

`places_left` makes of what module 1 answered last for a pair the places that are left of its peer,
`deciding_motion` says how one of the two robots would have to drive.
"""
