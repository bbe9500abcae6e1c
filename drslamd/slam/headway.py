"""Signs of headway: what computes for long says now and then that it has come further.

Whether a computation is long or stuck cannot be seen from outside. So each step of the solvers
leaves a mark here, and the watchdog looks whether there are new ones. Marks stand only in loops
that have an end by themselves. Nothing that is computed depends on them.
"""

from __future__ import annotations


class _Marks:
    made = 0


def mark() -> None:
    """One step further; any thread may say so."""
    _Marks.made += 1


def marks() -> int:
    """A number that is another one after each `mark`."""
    return _Marks.made
