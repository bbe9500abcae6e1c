"""Does the network carry messages both ways, to every robot of the team?"""

from __future__ import annotations

from collections.abc import Iterator

from drslamd.doctor.patient import Patient, warning
from drslamd.machine.finding import Finding, Severity

MOST_LOSS = 0.3
"""Up to this share of lost messages a team is as good as without loss."""
SILENT_S = 30.0


def peers_heard(patient: Patient) -> Iterator[Finding]:
    yield from patient.told("network", "network", severity=Severity.ERROR)
    peers = patient.now["peers"]
    deaf = [robot for robot, peer in peers.items() if peer["alive"] and not peer["hears_us"]]
    if deaf:
        yield warning(
            "peers",
            f"robot {', '.join(deaf)} is heard but does not hear this one",
            "let multicast through both ways: firewall, access point (IGMP snooping, isolation)",
        )
    for robot, peer in peers.items():
        if not peer["alive"] and peer["age_s"] > SILENT_S:
            cause = f"robot {robot} is silent"
            yield Finding(
                "peers",
                Severity.WARNING,
                cause,
                "is it switched on, and in this network?",
                since_s=round(peer["age_s"]),
            )
        elif peer["alive"] and peer["loss"] > MOST_LOSS:
            yield warning(
                "peers",
                f"{100 * peer['loss']:.0f} % of the messages of robot {robot} are lost",
                "bring them nearer, use another WiFi channel, or raise the multicast rate of the "
                "access point",
            )
