"""Closures that the consistency check leaves out, and the partner with which it is worst."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding
from drslamd.slam.chi_squared import quantile3

ENOUGH = 8
"""Closures of which something can be said."""
FEWEST = 0.5
"""Share of them that should be kept; of honest ones nine in ten are."""


def closures_refused(patient: Patient) -> Iterator[Finding]:
    kept = {
        robot: (pair["closures_kept"] / pair["closures_seen"], pair)
        for robot, pair in patient.now["pairs"].items()
        if pair["closures_seen"] >= ENOUGH
    }
    if not kept:
        return
    worst, (share, pair) = min(kept.items(), key=lambda item: item[1][0])
    if share >= FEWEST:
        return
    epsilon = patient.config.consistency.epsilon
    yield warning(
        "closures",
        f"of {pair['closures_seen']} closures with robot {worst} {pair['closures_kept']} agree "
        f"(gate: chi-squared {quantile3(1 - epsilon):.1f} at consistency.epsilon = {epsilon}); "
        "no other pair is worse",
        "look at wheels and antennas of both; if all pairs are like this, the sigmas in [odometry] "
        "and relative_pose.range_sigma_m promise too much",
    )
