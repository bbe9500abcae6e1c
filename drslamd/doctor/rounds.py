"""The order in which the checks are asked: what is found first may be why the rest is."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from drslamd.config import Config
from drslamd.doctor.daemon.antenna_place import antenna_place
from drslamd.doctor.daemon.checksums import checksums
from drslamd.doctor.daemon.closures_refused import closures_refused
from drslamd.doctor.daemon.duplicate_id import duplicate_id
from drslamd.doctor.daemon.frame_rate import frame_rate
from drslamd.doctor.daemon.geometry import geometry
from drslamd.doctor.daemon.localisation import localisation
from drslamd.doctor.daemon.module_mode import module_mode
from drslamd.doctor.daemon.odometry_rate import odometry_rate
from drslamd.doctor.daemon.peer_clocks import peer_clocks
from drslamd.doctor.daemon.peers_heard import peers_heard
from drslamd.doctor.daemon.processor import processor
from drslamd.doctor.daemon.robots_in_doubt import robots_in_doubt
from drslamd.doctor.daemon.team_key import team_key
from drslamd.doctor.daemon.traffic_budget import traffic_budget
from drslamd.doctor.daemon.wheel_mounting import wheel_mounting
from drslamd.doctor.machine.can_state import can_state
from drslamd.doctor.machine.igmp import igmp
from drslamd.doctor.machine.multicast_echo import multicast_echo
from drslamd.doctor.machine.rp_filter import rp_filter
from drslamd.doctor.patient import Patient
from drslamd.host.kernel import Host
from drslamd.machine.examination import examination
from drslamd.machine.finding import Finding
from drslamd.machine.refusals import SECOND_DAEMON

MACHINE: tuple[Callable[[Config, Host], Iterator[Finding]], ...] = (
    can_state,
    multicast_echo,
    rp_filter,
    igmp,
)
DAEMON: tuple[Callable[[Patient], Iterator[Finding]], ...] = (
    duplicate_id,
    module_mode,
    frame_rate,
    checksums,
    odometry_rate,
    peers_heard,
    team_key,
    peer_clocks,
    wheel_mounting,
    antenna_place,
    traffic_budget,
    processor,
    geometry,
    closures_refused,
    robots_in_doubt,
    localisation,
)


def of_machine(config: Config, host: Host | None = None) -> list[Finding]:
    """What a start would need, and what it would not notice; that a daemon runs is well."""
    place = host or Host()
    found = [f for f in examination(config, place) if f.check != SECOND_DAEMON]
    return found + [finding for look in MACHINE for finding in look(config, place)]


def of_daemon(patient: Patient) -> list[Finding]:
    """What a daemon that runs shows."""
    return [finding for look in DAEMON for finding in look(patient)]


def together(machine: list[Finding], daemon: list[Finding]) -> list[Finding]:
    """All of it; of what both say, what the daemon says, who knows since when."""
    told = {finding.cause for finding in daemon}
    return [finding for finding in machine if finding.cause not in told] + daemon


def names() -> list[str]:
    """Of all checks, in words."""
    looks = ["machine", *(look.__name__ for look in MACHINE), *(look.__name__ for look in DAEMON)]
    return [name.replace("_", " ") for name in looks]
