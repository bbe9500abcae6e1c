"""Windows that cannot say where the other robot is, because of how both drive."""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding
from drslamd.slam.relative_pose.estimate import Verdict

ENOUGH = 10
"""Windows of which something can be said."""
MOST = 0.8
"""Share of them; some always come while robots stand."""
REMEDIES = {
    Verdict.UNOBSERVABLE.value: "drive curves, not side by side and not on one line",
    Verdict.AMBIGUOUS.value: "one of the two has to turn: a mirrored pose fits as well",
}


def geometry(patient: Patient) -> Iterator[Finding]:
    for robot, pair in patient.now["pairs"].items():
        windows, total = pair["windows"], sum(pair["windows"].values())
        for verdict, remedy in REMEDIES.items():
            share = windows.get(verdict, 0) / max(total, 1)
            if not pair["connected"] and total >= ENOUGH and share > MOST:
                yield warning(
                    "geometry",
                    f"of the windows with robot {robot} {100 * share:.0f} % say: {verdict}",
                    remedy,
                )
