"""What the owner of a pair measured: ranges and closures between two robots."""

from __future__ import annotations

from dataclasses import dataclass, field

from drslamd.conventions import Chain
from drslamd.slam.graph.chapters.replaced_entries import Span
from drslamd.slam.graph.clocks import Ahead, ClockDifferences
from drslamd.slam.graph.measurements import ClosureMeasurement, RangeMeasurement
from drslamd.slam.graph.said_rows import SaidRows
from drslamd.slam.graph.tables import CLOSURE_COLUMNS, RANGE_COLUMNS, ClosureTable, RangeTable

MAX_RANGES = 40_000
"""Of one pair, 3.5 MB: more than one a second for all the time that is held
(`timed_rows.HELD_BLOCKS`)."""
MAX_CLOSURES = 40_000
"""Of one pair, 5.8 MB, likewise; those that were withdrawn are among them, because a withdrawal may
come before what it withdraws."""

FARTHEST_M = 10_000.0
"""No radio of this kind reaches so far."""
BEST_SIGMA = 1e-4
"""m and rad; a better closure than this was not measured."""
WORST_SIGMA = 300.0
"""m and rad; nor a worse one."""


@dataclass
class PairData:
    """One pair: a is the owner's chain, b the peer's."""

    a: Chain
    b: Chain
    said_ranges: SaidRows = field(default_factory=lambda: SaidRows(RANGE_COLUMNS, 2, MAX_RANGES))
    said_closures: SaidRows = field(
        default_factory=lambda: SaidRows(CLOSURE_COLUMNS, 2, MAX_CLOSURES, before=3)
    )
    _clocks_of_ranges: ClockDifferences = field(default_factory=ClockDifferences)
    _clocks_of_closures: ClockDifferences = field(default_factory=ClockDifferences)
    _ahead: Ahead | None = None
    _ahead_changes: tuple[int, int] = (0, 0)

    def add_range(self, place: int, r: RangeMeasurement, entry: int) -> None:
        """A range that was first said at some place in its owner's log, as an entry says it."""
        if abs(r.range_m) < FARTHEST_M and r.sigma_m > 0:
            self.said_ranges.say(RangeTable.row(place, r), entry)

    def add_closure(self, place: int, c: ClosureMeasurement, entry: int) -> None:
        """A closure, or its withdrawal; of one number the latest word counts."""
        if _is_believable(c):
            self.said_closures.say(ClosureTable.row(place, c), entry)

    def replace(self, spans: tuple[Span, ...]) -> None:
        """Chapters stand for these entries of the owner."""
        self.said_ranges.replace(spans)
        self.said_closures.replace(spans)

    @property
    def ranges(self) -> RangeTable:
        """All of them."""
        return RangeTable(self.said_ranges.rows)

    @property
    def closures(self) -> ClosureTable:
        """Those that were not withdrawn."""
        return ClosureTable(self.said_closures.rows).kept()

    def kept_closures(self) -> list[ClosureMeasurement]:
        """The same one by one."""
        return self.closures.measurements(self.b)

    def ahead(self) -> Ahead | None:
        """How the clocks of the two differ, None where nothing was measured."""
        changes = self.said_ranges.changes, self.said_closures.changes
        if changes != self._ahead_changes:
            self._clocks_of_ranges.take(self.said_ranges, RangeTable.B_N)
            self._clocks_of_closures.take(self.said_closures, ClosureTable.B_N)
            self._ahead = self._clocks_of_ranges.together(self._clocks_of_closures)
            self._ahead_changes = changes
        return self._ahead


def _is_believable(c: ClosureMeasurement) -> bool:
    variances = (c.covariance[k] for k in (0, 3, 5))
    return all(BEST_SIGMA**2 < v < WORST_SIGMA**2 for v in variances) and all(
        abs(v) < FARTHEST_M for v in c.a_T_b
    )
