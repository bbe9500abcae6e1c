"""One more second of a team that is solved already: most of it is as it was.

Entry: `kept_solver.solve`. `elimination` takes a system apart in dense blocks;
`kept_factor` keeps what the old part of a team's system came to, and takes the newest seconds up
anew each time; what is left for the `border` of a large team is kept for some seconds as well. That
is no longer the system of where the team is, but near it, so `fixed_point` steps by it down the
exact gradient, to the same solution, in coordinates in which it does not matter how the team has
been turned as a whole. `kept_solution` is all that is kept. `quick_check` sees whether all is as
modelled, and `kept_claims` how sure it is. Whatever does not fit goes to `banded.banded_solver`.
"""
