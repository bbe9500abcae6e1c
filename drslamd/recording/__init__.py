"""What one robot heard and did, as a file that LCM's own tools open (README.md)."""
