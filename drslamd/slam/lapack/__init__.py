"""Linear algebra by LAPACK, for modules 1 and 3: ``routines`` are what they call."""
