"""Looking for faults on purpose: fuzzers, a lying member, planted bugs, mutants (README.md)."""
