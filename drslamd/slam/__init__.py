"""The three modules of the paper and the geometry under them: arrays in, arrays out."""
