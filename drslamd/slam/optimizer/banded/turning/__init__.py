"""How the valley of the team's cost bends, because what little holds is turned as a whole.

`chart`: coordinates in which such turns go straight on; `curvature`: second derivatives there."""
