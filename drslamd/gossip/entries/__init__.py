"""What the entries of a log are made of, and the chapters that say them again."""
