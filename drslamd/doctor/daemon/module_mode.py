"""The UWB module: its port, its mode, its id, its supply, as the daemon's codec sees them."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient
from drslamd.machine.finding import Finding, Severity


def module_mode(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("module mode", "uwb", severity=Severity.ERROR)
