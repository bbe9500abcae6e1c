"""How sure robots are of each other, where sensors turn out better than configured.

What is configured must be allowed for in any room, and the pose of a robot in the frame of the team
is claimed with it: it hangs on constants that few ranges tell. Where two robots are in each other
is held by their own ranges of late and by both odometries, and how wrong these are is seen in every
second. `expected_squares` says to what the squares of ranges would come if they were as wrong as
configured, and `narrowing` how much less is claimed of a pair where they come to less.
"""
