"""How each thing is made to go wrong on a stage."""
