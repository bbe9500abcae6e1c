"""How sure robots are of where they are, where sensors turn out better than configured.

What is configured must be allowed for in any room; how wrong ranges and odometry are is seen in
every second. `expected_squares` says to what the squares of ranges would come if they were as wrong
as configured, and `narrowing` how much less is claimed of a pose or a pair where they come to less.
"""
