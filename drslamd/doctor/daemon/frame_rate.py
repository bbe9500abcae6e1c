"""How often the UWB module ranges: windows need some ranges a second to every robot."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding

FEWEST_HZ = 5.0
"""Frames with ranges. Modules do 25 to 200; below this windows of moving robots are thin."""


def frame_rate(patient: Patient) -> Iterator[Finding]:
    hz = patient.rate("uwb", "counters", "frames.accepted")
    if 0 < hz < FEWEST_HZ:
        yield warning(
            "frame rate",
            f"only {hz:.1f} ranging frames a second from the UWB module",
            "raise its update rate with NAssistant to 25 Hz or more",
        )
