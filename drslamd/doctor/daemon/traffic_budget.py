"""How much of the budget of bytes is used, and who says too much."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding

NEARLY = 0.8
"""Of `gossip.max_bytes_per_s`."""


def traffic_budget(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("budget", "team.flood", "budget")
    used, allowed = patient.rate("network", "bytes_sent"), patient.config.gossip.max_bytes_per_s
    if used > NEARLY * allowed and patient.condition("budget") is None:
        yield warning(
            "budget",
            f"{used:.0f} of {allowed} bytes a second are used",
            "raise gossip.max_bytes_per_s if the network can carry it",
        )
    dropped = patient.rate("network", "dropped")
    if dropped > 0 and patient.now["network"]["up"]:
        yield warning(
            "budget",
            f"the network did not take {dropped:.1f} messages a second",
            "its queue is full: look at the signal, or lower gossip.max_bytes_per_s",
        )
