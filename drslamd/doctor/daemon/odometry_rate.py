"""The wheels: what the daemon says of them, and how often they are heard."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding, Severity

FEWEST_HZ = 10.0
"""Odometry is kept at 10 Hz; samples that come more rarely are interpolated over curves."""


def odometry_rate(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("odometry", "wheels", severity=Severity.ERROR)
    hz = patient.rate("wheels", "counters", "samples.accepted")
    if 0 < hz < FEWEST_HZ:
        yield warning(
            "odometry",
            f"only {hz:.1f} wheel samples a second",
            "make the base send 20 or more (poll_hz of a Roboteq)",
        )
