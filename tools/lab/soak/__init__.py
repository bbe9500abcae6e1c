"""A team in virtual time with one seed, everything that can go wrong, and the promises it keeps."""
