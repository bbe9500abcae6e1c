"""The share of what comes from the UWB module that arrives damaged."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding

MOST = 0.01
"""Of frames, or of bytes: a good cable damages none in a day."""


def checksums(patient: Patient) -> Iterator[Finding]:
    frames = sum(
        patient.rate("uwb", "counters", name)
        for name in patient.now["uwb"]["counters"]
        if name.startswith("frames.")
    )
    bad = patient.rate("uwb", "counters", "bad_checksums")
    garbage = patient.rate("uwb", "counters", "garbage_bytes")
    arrived = patient.rate("uwb", "counters", "bytes")
    if bad > MOST * (frames + bad):
        yield warning(
            "checksums",
            f"{100 * bad / (frames + bad):.0f} % of the frames of the UWB module are damaged",
            "take a shorter or shielded cable, another USB port, or a lower uwb.baud at both ends",
        )
    elif arrived and garbage > MOST * arrived:
        yield warning(
            "checksums",
            f"{100 * garbage / arrived:.0f} % of the bytes of the UWB module belong to no frame",
            "is it the only one that speaks on this line, and is uwb.baud right?",
        )
