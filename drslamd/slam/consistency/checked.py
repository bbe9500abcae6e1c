"""What module 2 made of one pair so far: its closures and the largest set that agrees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drslamd.conventions import Segment
from drslamd.slam.consistency.candidates import corrected_sums
from drslamd.slam.consistency.pcm import Candidate, PairConsistency
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.odometry.correction import Correction


@dataclass
class Checked:
    """Module 2 has run: the consistent set, and whose hypothesis each of its vertices is.

    Attributes:
        decided: evidence of each window for its best hypothesis against its others, by number.
    """

    segments: tuple[Segment, Segment]
    consistency: PairConsistency
    measurements: list[ClosureMeasurement]
    decided: dict[int, float]

    def kept(self) -> tuple[ClosureMeasurement, ...]:
        """Closures of the consistent set."""
        return tuple(self.measurements[v] for v in self.consistency.kept_vertices())

    def rivals(self, decides: float) -> int:
        """Size of the largest set that contradicts what is kept.

        Once the newest window has decided for what is kept, sets count only as far as windows had
        decided for them: it holds what those held that had not, and more.

        Args:
            decides: evidence with which a window does.
        """
        best = {m.number: v for v, m in reversed([*enumerate(self.measurements)])}
        sure = [v for number, v in best.items() if self.decided.get(number, 0.0) >= decides]
        newest = best[max(best)]
        is_decided = newest in sure and newest in self.consistency.kept_vertices()
        return self.consistency.rivals(sure if is_decided else None)

    def renew_sums(
        self, own: ChainData, peer: ChainData, corrections: tuple[Correction, Correction]
    ) -> None:
        """Keyframes that came late may lie between those of the candidates.

        Args:
            corrections: of the odometry of both.
        """
        a, a_there = own.keyframes.find(np.array([m.a_n for m in self.measurements]))
        b, b_there = peer.keyframes.find(np.array([m.b_n for m in self.measurements]))
        both = a_there & b_there
        sums = own.sums[a[both]], peer.sums[b[both]]
        self.consistency.renew_sums(np.flatnonzero(both), *map(corrected_sums, corrections, sums))


def extended(
    checked: Checked,
    work: list[tuple[Candidate, ClosureMeasurement]],
    sure: Mapping[int, float],
) -> Checked:
    """Equation (3) for each new hypothesis; `sure` as in `Checked.decided`."""
    for candidate, measurement in work:
        forgotten = checked.consistency.forgotten
        checked.consistency.add(candidate)
        del checked.measurements[: checked.consistency.forgotten - forgotten]
        checked.measurements.append(measurement)
    oldest = checked.measurements[0].number if checked.measurements else 0
    known = {**checked.decided, **sure}
    checked.decided = {number: value for number, value in known.items() if number >= oldest}
    return checked
