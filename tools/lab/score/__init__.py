"""What came out: errors against the truth, tables, pictures."""
