"""Module 3 over messages: robots that know only their own edges, and say them in datagrams."""
