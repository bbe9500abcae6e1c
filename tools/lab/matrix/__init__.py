"""The fault matrix: 64 rows, the tests that name them, and the page of both."""
