"""What a robot says again of its older log entries: entry `books.condensed`."""
