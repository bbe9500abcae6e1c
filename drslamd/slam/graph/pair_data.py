"""What the owner of a pair measured: ranges and closures between two robots."""

from __future__ import annotations

from dataclasses import dataclass, field

from drslamd.conventions import Chain
from drslamd.slam.graph.measurements import ClosureMeasurement, RangeMeasurement
from drslamd.slam.graph.tables import RANGE_COLUMNS, KeyedRows, RangeTable

MAX_RANGES = 20_000
"""Of one pair, 1.6 MB; the oldest are forgotten."""
MAX_CLOSURES = 4_000
"""Of one pair."""
PER_ENTRY = 4_096
"""Above the number of ranges that any one entry of a log can hold."""

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
    closures: dict[int, tuple[int, ClosureMeasurement]] = field(default_factory=dict)
    """By number: (seq of the log entry that said so, closure)."""
    _ranges: KeyedRows = field(default_factory=lambda: KeyedRows(RANGE_COLUMNS, MAX_RANGES))

    def add_range(self, seq: int, place: int, r: RangeMeasurement) -> None:
        """A range at some place in the log of its owner."""
        if abs(r.range_m) < FARTHEST_M and r.sigma_m > 0:
            key = seq * PER_ENTRY + place
            self._ranges.add(RangeTable.row(key, r.a_n, r.b_n, r.q_a, r.q_b, r.range_m, r.sigma_m))

    def add_closure(self, seq: int, c: ClosureMeasurement) -> None:
        """A closure, or its withdrawal; of one number the latest word counts."""
        if self.closures.get(c.number, (-1, c))[0] <= seq and _is_believable(c):
            self.closures[c.number] = (seq, c)
            while len(self.closures) > MAX_CLOSURES:
                del self.closures[min(self.closures)]

    @property
    def ranges(self) -> RangeTable:
        """All of them."""
        return RangeTable(self._ranges.data)

    def replace_ranges(self, table: RangeTable) -> None:
        """Let these be all."""
        self._ranges.replace(table.rows)

    def kept_closures(self) -> list[ClosureMeasurement]:
        """Those that were not withdrawn, by number."""
        return [c for _, (_, c) in sorted(self.closures.items()) if c.kept]


def _is_believable(c: ClosureMeasurement) -> bool:
    variances = (c.covariance[k] for k in (0, 3, 5))
    return all(BEST_SIGMA**2 < v < WORST_SIGMA**2 for v in variances) and all(
        abs(v) < FARTHEST_M for v in c.a_T_b
    )
