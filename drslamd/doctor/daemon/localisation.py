"""Why there is no pose, and what the next start will not know: after everything that may be why."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient
from drslamd.machine.finding import Finding


def localisation(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("pose", "pose")
    yield from patient.told("site", "site")
    yield from patient.told("state", "state")
