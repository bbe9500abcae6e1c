"""An antenna that is not where the configuration says."""

from __future__ import annotations

import math
from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding

FAR_M = 0.1
"""From where it is configured: as far as a range is wrong."""


def antenna_place(patient: Patient) -> Iterator[Finding]:
    learned = patient.now["graph"].get("antenna_m", {}).get(str(patient.now["robot"]))
    if learned is None or math.hypot(*learned) <= FAR_M:
        return
    uwb = patient.config.uwb
    x, y = uwb.antenna_x_m + learned[0], uwb.antenna_y_m + learned[1]
    yield warning(
        "antenna",
        f"the antenna seems to be {math.hypot(*learned):.2f} m from where it is configured",
        f"measure it; ranges say uwb.antenna_x_m = {x:.2f} and uwb.antenna_y_m = {y:.2f}",
    )
