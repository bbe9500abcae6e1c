"""Has the daemon the computer that it needs?"""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding

MOST_CPU = 0.8
"""Of a core: modules rest so that they stay below."""
LATE_MS = 100.0
"""Of the loop, in 99 of 100 cases: a tenth of a second is one step of odometry."""


def processor(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("processor", "load")
    yield from patient.told("processor", "sleep")
    cpu = patient.rate("cpu_s")
    if cpu > MOST_CPU:
        yield warning(
            "processor",
            f"the daemon takes {100 * cpu:.0f} % of a core",
            "please report it with drslamd status --json; lower optimizer.rate_hz meanwhile",
        )
    late = patient.now["loop_lag_ms"]["p99"]
    if late > LATE_MS:
        yield warning(
            "processor",
            f"the daemon is woken {late:.0f} ms late at times",
            "another program takes the computer: look with top, or give it CPUWeight= in the unit",
        )
