"""tools/accuracy: every real recording, one set of parameters, one table."""
