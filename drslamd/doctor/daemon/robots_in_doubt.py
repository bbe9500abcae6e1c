"""Poses that what was measured contradicts, and why."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding


def robots_in_doubt(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("doubt", "doubt", "odometry", "sight", "partners")
    for robot, peer in patient.now["peers"].items():
        if peer["alive"] and peer["pose"] in ("doubtful", "stale"):
            yield warning(
                "doubt",
                f"robot {robot} says that its own pose is {peer['pose']}",
                f"drslamd doctor on robot {robot} says why",
            )
