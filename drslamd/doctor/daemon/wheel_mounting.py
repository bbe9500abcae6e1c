"""Wheels that are not as configured: directions and scales, as ranges tell them."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, number, warning
from drslamd.machine.finding import Finding

WORTH_SETTING = 0.1
"""A scale that is so far off is learned at every start, and costs the first minutes."""


def wheel_mounting(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("wheels", "gyro", "wheels.slip", "wheels.track", "mounting")
    own = str(patient.now["robot"])
    scale = number(patient.now, ("graph", "wheel_scale", own))
    if abs(scale) > WORTH_SETTING:
        yield warning(
            "wheels",
            f"ranges say that the ways of this robot are {100 * (1 - scale):.0f} % of what its "
            "wheels count",
            f"divide wheels.counts_per_metre by {1 - scale:.2f}, or correct radius or unit by that",
        )
    turn = number(patient.now, ("graph", "wheel_turn", own))
    if abs(turn) > WORTH_SETTING:
        yield warning(
            "wheels",
            f"ranges say that the turns of this robot are {100 * (1 + turn):.0f} % of what its "
            "wheels count",
            f"divide wheels.track_m by {1 + turn:.2f}",
        )
