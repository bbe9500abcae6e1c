"""Why a robot is not (yet) where it should be: every silent stage gets a reason and a remedy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from drslamd.conditions import contradictions, turns
from drslamd.conditions.health import Health
from drslamd.conditions.ports import port_cause, port_remedy
from drslamd.config import Config
from drslamd.config_wheels import SerialWheelSection
from drslamd.conventions import SECOND_US
from drslamd.events import NetworkState, Note, Port, PortCondition, PortState, Slept
from drslamd.gossip.message_types import PoseState
from drslamd.gossip.outbox import Outbox
from drslamd.gossip.team import Team
from drslamd.jobs import OPTIMIZER, RELATIVE_POSE, DutyCycle, Jobs
from drslamd.memory import Memory
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from drslamd.sensors.wheels.wheel_input import WheelInput
from drslamd.slam.back_end import BackEnd
from drslamd.slam.calibration.window_calibration import has_learned
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.doubt import doubted_partners
from drslamd.slam.front_end import FrontEnd
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relative_pose.estimate import Verdict
from drslamd.standing import Standing
from drslamd.whereabouts import Whereabouts

PATIENCE_US = 3 * SECOND_US
"""How long an open port may be silent before that is worth a word."""

SLEEP_TOLD_US = 60 * SECOND_US
"""How long it is said that the computer was asleep: by then windows have been measured anew."""

LATE = 2
"""A module that runs half as often as it should is worth a word."""

SITE = "drive past two of its modules, or measure their coordinates in [[beacon]] anew"

ANSWERS = {Verdict.UNIQUE.value, Verdict.AMBIGUOUS.value}
"""Verdicts of windows that named a pose."""

Condition = tuple[str, "str | None"]
"""A key, and a sentence when something is wrong."""


class Stages(Protocol):
    """The parts of a robot, from its sensors to its pose."""

    config: Config
    uwb: LinkTrackInput
    wheels: WheelInput
    team: Team
    front: FrontEnd
    back: BackEnd
    standing: Standing
    outbox: Outbox
    ports: dict[str, PortState]
    health: Health
    network: NetworkState | None
    slept: Slept | None
    memory: Memory
    jobs: Jobs

    def neighbours(self, utime: int) -> list[PeerInRange]: ...

    def whereabouts(self, utime: int) -> Whereabouts: ...


def diagnose(robot: Stages, utime: int, key: str | None = None) -> list[Note]:
    """State the conditions anew, what should be logged about them.

    Args:
        key: this one alone, because a port or the network has just changed: no answer says both
            that it is open and why it cannot be opened. Others may not have been tried yet.
    """
    found = ((k, why) for k, why in conditions(robot, utime) if key in (None, k))
    return [note for k, why in found for note in robot.health.set(k, why, utime)]


def conditions(robot: Stages, utime: int) -> Iterator[Condition]:
    """Everything that is looked after, sensor by sensor and stage by stage."""
    yield "uwb", _sensor(robot, "uwb", robot.uwb.advice, utime)
    yield "wheels", _sensor(robot, "wheels", robot.wheels.advice, utime)
    yield from turns.conditions(robot.wheels.gyro, utime)
    network = robot.network
    yield "network", None if network is None or network.up else network.detail
    yield "sleep", _sleep(robot.slept, utime)
    yield from robot.team.conditions(utime)
    where = robot.whereabouts(utime)
    yield "pose", _why_not_localised(robot, where, utime)
    doubt = where.doubt
    yield "doubt", contradictions.doubt(doubt)
    yield "odometry", contradictions.odometry(_is_worse(robot)) if not doubt else None
    yield "sight", contradictions.sight(_out_of_sight(robot))
    yield "partners", contradictions.partners(_doubted_partners(robot) if not doubt else ())
    yield "mounting", _mountings(robot)
    site = robot.standing.site()
    yield "site", f"no frame of the site: {site}; {SITE}" if isinstance(site, str) else None
    yield "load", _load(robot, utime)
    yield "budget", robot.outbox.condition(utime)
    yield "state", _state(robot, utime)


def _sensor(
    robot: Stages, name: Port, advice: Callable[[int], str | None], utime: int
) -> str | None:
    """The fault of its port, or what its codec says once the port has been open for a while."""
    state = robot.ports.get(name)
    if state is None:
        return advice(utime)
    if state.condition is not PortCondition.OPEN:
        cause = port_cause(name, state.condition, state.detail)
        is_serial = name == "uwb" or isinstance(robot.config.wheels, SerialWheelSection)
        return f"{cause}; {port_remedy(name, state.condition, is_serial)}"
    return advice(utime) if utime - state.utime > PATIENCE_US else None


def _sleep(slept: Slept | None, utime: int) -> str | None:
    if slept is None or utime - slept.utime > SLEEP_TOLD_US:
        return None
    seconds = slept.asleep_us / SECOND_US
    return (
        f"the computer was asleep for {seconds:.0f} s: clocks and windows begin anew; switch off "
        "suspend on a robot"
    )


def _load(robot: Stages, utime: int) -> str | None:
    """Modules that cannot run as often as they should, and pairs that module 3 has no room for."""
    config = robot.config
    rates = {RELATIVE_POSE: config.relative_pose.rate_hz, OPTIMIZER: config.optimizer.rate_hz}
    found = []
    for module, rate in rates.items():
        since, until = robot.jobs.cycles.get(module, DutyCycle())
        cycle = (until - since) / SECOND_US
        if until + LATE * SECOND_US > utime and cycle > LATE / rate:
            found.append(f"{module} runs every {cycle:.1f} s instead of every {1 / rate:.1f} s")
    late = (
        f"{', '.join(found)}, to leave time for the sensors: the team is large for this computer, "
        "or other programs take it"
    )
    estimate = robot.back.estimate
    left_out = estimate.left_out if estimate is not None else 0
    few = f"ranges of {left_out} pairs are left out, to bound memory: the team is large"
    said = [part for part, is_said in ((late, found), (few, left_out)) if is_said]
    return "; ".join(said) or None


def _doubted_partners(robot: Stages) -> Iterable[int]:
    front = robot.front
    return doubted_partners(front.own.robot, robot.back.estimate, front.watch.doubted)


def _out_of_sight(robot: Stages) -> Iterable[int]:
    estimate = robot.back.estimate
    return estimate.out_of_sight(robot.front.own.robot) if estimate else ()


def _is_worse(robot: Stages) -> bool:
    """Was our odometry much worse than configured, without a reason to doubt where we are?"""
    estimate = robot.back.estimate
    return estimate is not None and estimate.has_worse_odometry(robot.front.own.robot)


def _mountings(robot: Stages) -> str | None:
    """What was found wrong with the wheels of whom, and whose windows nothing explains."""
    own, pairs, estimate = robot.front.own.robot, robot.front.pairs, robot.back.estimate
    said = []
    for peer, pair in pairs.items():
        found = pair.search.found
        agrees = found is not None and has_learned(estimate, (own, peer), found)
        said.append(contradictions.mounting(own, peer, pair.search, _is_odd(pairs, peer), agrees))
    return "; ".join(sentence for sentence in said if sentence) or None


def _is_odd(pairs: dict[int, PairTracker], peer: int) -> bool:
    """Is it the peer that is wrong: do we agree with somebody else?"""
    others = (pair for robot, pair in pairs.items() if robot != peer)
    return any(pair.connected and pair.search.found is None for pair in others)


def _state(robot: Stages, utime: int) -> str | None:
    memory = robot.memory
    if not memory.fault:
        return None
    listens = "this start only listens for ten seconds, and " if memory.is_listening(utime) else ""
    return (
        f"{memory.fault}: {listens}the next start will not know what this one learned, nor its "
        "number; make room, make the folder writable, or name another in daemon.state_dir"
    )


def why_not_localised(robot: Stages, utime: int) -> str | None:
    """The first stage at which it stops, None when the robot is localised."""
    return _why_not_localised(robot, robot.whereabouts(utime), utime)


def _why_not_localised(robot: Stages, where: Whereabouts, utime: int) -> str | None:
    if robot.team.namesakes.is_own_id_used(utime):
        return "not localised: another robot uses the id of this one; no other reason counts"
    if where.state is PoseState.POSITION:
        estimate = robot.back.estimate
        return contradictions.only_place(
            estimate is not None and robot.front.own.robot in estimate.mirrored
        )
    if where.is_old:
        return _why_old(robot, where.age_us, utime)
    if where.pose is not None:
        return None
    if robot.back.estimate is not None:
        return "not localised: the odometry was interrupted, and what follows it has no place yet"
    if robot.back.onlooked is not None:
        why = robot.front.resumption.verdict or "its odometry has just begun"
        return (
            "not localised: its last start was, and by ranges to robots that are it looks for the "
            f"place of this one ({why}); drive a metre or two"
        )
    peers = robot.team.everybody
    living = robot.team.living(utime)
    if not peers:
        network = robot.network
        if network is not None and network.up and utime - network.utime <= PATIENCE_US:
            return "not localised: the network has just been joined; others speak every second"
        return (
            "not localised: no other robot is heard; is drslamd running on them, in this network, "
            "with the same gossip.group and port?"
        )
    if not living:
        return (
            f"not localised: robots {_listed(peers)} are heard but do not hear this one; "
            "is multicast let through in both directions?"
        )
    near = robot.neighbours(utime)
    if not near:
        return (
            f"not localised: no ranges to robots {_listed(living)}; are their modules on, in the "
            "same DR mode and of one firmware, and is uwb.id right on every robot?"
        )
    if not len(robot.front.reckoning.track):
        return "not localised: no odometry yet"
    owned = [(k, pair) for k, pair in robot.front.pairs.items() if k in living]
    if not owned:
        return (
            f"not localised: closures with this robot are made by robots "
            f"{_listed(peer.chain.robot for peer in near)}; ask them"
        )
    reasons = [f"{_why_not_connected(pair)} (with robot {k})" for k, pair in owned]
    return f"not localised: {', '.join(reasons)}; drive curves, and not side by side"


def _why_old(robot: Stages, age_us: int, utime: int) -> str:
    """What is said of a pose that has no odometry since then."""
    seconds = age_us // SECOND_US
    relocation = robot.front.relocation
    if relocation.by_ranges(utime) is not None and relocation.verdict:
        return (
            f"odometry was interrupted {seconds} s ago: ranges say where it is, not yet how it "
            f"stands ({relocation.verdict}); drive a metre or two"
        )
    if relocation.by_ranges(utime) is not None:
        return (
            f"no odometry for {seconds} s: the position is that of ranges to other robots, the "
            "heading is not known; check the wheels"
        )
    return (
        f"no odometry for {seconds} s: the pose is that of then, and its sigma grows as fast "
        "as the robot drives; check the wheels"
    )


def _why_not_connected(pair: PairTracker) -> str:
    """What keeps a pair from being believed: its windows, or closures that do not agree yet."""
    if not pair.closures_seen or pair.last_verdict not in ANSWERS:
        return pair.last_verdict or "nothing measured yet"
    if pair.connected:
        return "connected, the graph is about to be solved"
    enough = len(pair.kept) >= pair.agreement.least
    agree = f"{len(pair.kept)} of {pair.closures_seen} closures agree"
    if pair.agreement.confirms and enough and pair.search.is_undecided:
        return (
            f"{agree}, but the same ranges would rather fit wheels of another track or size, and "
            "not clearly; look at the wheels of both"
        )
    if pair.agreement.confirms and enough and not pair.search.is_confirmed:
        return (
            f"{agree}, but the same ranges would fit wheels that run backwards, until both have "
            "driven more"
        )
    return f"{agree}, {pair.agreement.least} must and outnumber all others"


def _listed(robots: object) -> str:
    return ", ".join(str(robot) for robot in sorted(robots))  # type: ignore[call-overload]
