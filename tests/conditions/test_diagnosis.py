"""Every silent stage has a reason and a remedy, in one sentence."""

from __future__ import annotations

from typing import Any, cast

import pytest
from frames import ascii_line
from message_builders import a_status, forged
from pair_scenes import BESIDE, asked_at, estimate_of
from robot_scenes import RobotScene

from drslamd.conditions.diagnosis import conditions, why_not_localised
from drslamd.conventions import SECOND_US, Segment
from drslamd.events import ChannelMessage, JobDone, NetworkState, PortCondition, PortState, Send
from drslamd.gossip import messages
from drslamd.gossip.message_types import Heard
from drslamd.jobs import OPTIMIZER, RELATIVE_POSE, Job
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.relative_pose.mistakes.mounting_search import MOST_ASKED


def said(scene: RobotScene, key: str) -> str | None:
    """The sentence of one condition."""
    return dict(conditions(scene.robot, scene.utime))[key]


def why(scene: RobotScene) -> str:
    return str(why_not_localised(scene.robot, scene.utime))


def test_everything_is_looked_after_from_the_sensors_to_the_budget() -> None:
    scene = RobotScene()
    keys = [key for key, _ in conditions(scene.robot, scene.utime)]
    team = [key for key in keys if key.startswith("team.")]
    of_poses = ["pose", "doubt", "odometry", "sight", "partners", "mounting"]
    turns = ["gyro", "wheels.slip", "wheels.track"]
    hardware = ["uwb", "wheels", *turns, "network", "sleep"]
    rest = ["site", "load", "budget", "state"]
    assert keys == [*hardware, *team, *of_poses, *rest]
    assert len(team) >= 4


def test_who_is_out_of_sight_is_told() -> None:
    scene = RobotScene()
    own = scene.robot.front.own.robot
    assert said(scene, "sight") is None
    estimate = TeamEstimate(Segment(own, 1, 0), {}, blocked=frozenset({(own, own + 1)}))
    scene.robot.back.estimate = estimate
    assert str(said(scene, "sight")).startswith(f"many ranges to robot {own + 1} are too long")


# ports and what is plugged in


@pytest.mark.parametrize("port", ["uwb", "wheels"])
@pytest.mark.parametrize(
    ("condition", "sentence"),
    [
        (PortCondition.MISSING, "missing: /dev/x: No such file"),
        (PortCondition.DENIED, "no permission: /dev/x: No such file"),
        (PortCondition.BUSY, "in use by another program: /dev/x: No such file"),
        (PortCondition.LOST, "lost: /dev/x: No such file"),
    ],
)
def test_a_port_that_cannot_be_used_says_so_at_once(
    port: str, condition: PortCondition, sentence: str
) -> None:
    scene = RobotScene()
    state = PortState(scene.utime, port, condition, "/dev/x: No such file")  # type: ignore[arg-type]
    scene.robot.handle(state)
    assert str(said(scene, port)).startswith(f"{port}: {sentence}; ")


@pytest.mark.parametrize("port", ["uwb", "wheels"])
@pytest.mark.parametrize(
    ("after_us", "is_said"), [(3 * SECOND_US, False), (3 * SECOND_US + 1, True)]
)
def test_an_open_port_may_be_silent_for_three_seconds(
    port: str, after_us: int, is_said: bool
) -> None:
    scene = RobotScene()
    state = PortState(scene.utime, port, PortCondition.OPEN)  # type: ignore[arg-type]
    scene.robot.handle(state)
    scene.utime += after_us
    silent = {
        "uwb": "no bytes from the UWB module yet: check its power, the cable and uwb.port",
        "wheels": "nothing from the wheels yet: check the power of the base and the cable",
    }
    assert said(scene, port) == (silent[port] if is_said else None)


def test_of_a_port_that_was_not_tried_yet_the_codec_says_what_lacks() -> None:
    scene = RobotScene()
    assert said(scene, "uwb") == scene.robot.uwb.advice(scene.utime)
    assert said(scene, "wheels") == scene.robot.wheels.advice(scene.utime)


def test_of_wheels_that_speak_nothing_is_said() -> None:
    ascii_base = 'source = "ascii"\nport = "x"\ntrack_m = 0.5\ncounts_per_metre = 1000.0\n'
    scene = RobotScene(wheels=ascii_base)
    for k in range(20):
        scene.later(0.02)
        scene.robot.wheels.feed(ascii_line(1000 + 20 * k, k, k), scene.utime)
    assert said(scene, "wheels") is None


@pytest.mark.parametrize(
    ("state", "sentence"),
    [
        (None, None),
        (NetworkState(0, True, "239.255.76.67"), None),
        (NetworkState(0, False, "cannot join on wlan7"), "cannot join on wlan7"),
    ],
)
def test_a_network_that_is_down_says_why(state: NetworkState | None, sentence: str | None) -> None:
    scene = RobotScene()
    if state is not None:
        scene.robot.handle(state)
    assert said(scene, "network") == sentence


def test_what_the_team_has_to_say_is_passed_on() -> None:
    scene = RobotScene()
    channel, payload = forged(a_status(), robot=3, secret=bytes(32))
    scene.robot.handle(ChannelMessage(scene.utime, channel, payload, "10.0.0.7"))
    sentence = said(scene, "team.wrong_tag")
    assert sentence is not None
    assert "do not fit the team key, from 10.0.0.7" in sentence


def test_a_budget_that_holds_messages_back_is_passed_on() -> None:
    scene = RobotScene(extra="[gossip]\nmax_bytes_per_s = 2000\n")
    assert said(scene, "budget") is None
    pose = Send(messages.channel("POSE", 0), bytes(1000))
    assert not all(scene.robot.outbox.passes(pose, scene.utime) for _ in range(9))
    assert "max_bytes_per_s = 2000 holds messages back" in str(said(scene, "budget"))


# load


def computed(scene: RobotScene, module: str, took_s: float) -> None:
    """The module has just computed so long; it rests four times as long."""
    solve = scene.robot.jobs.begin(Job(module), lambda: None)
    took = round(took_s * SECOND_US)
    scene.robot.jobs.finish(JobDone(scene.utime, solve.job_id, None, took))


@pytest.mark.parametrize(
    ("rate_hz", "took_s", "is_late"),
    [(1.0, 0.400, False), (1.0, 0.401, True), (0.5, 0.800, False), (0.5, 0.801, True)],
)
def test_a_module_that_runs_half_as_often_as_it_should_is_named(
    rate_hz: float, took_s: float, is_late: bool
) -> None:
    scene = RobotScene(extra=f"[optimizer]\nrate_hz = {rate_hz}\n")
    computed(scene, OPTIMIZER, took_s)
    sentence = (
        f"optimizer runs every {5 * took_s:.1f} s instead of every {1 / rate_hz:.1f} s, to leave "
        "time for the sensors: the team is large for this computer, or other programs take it"
    )
    assert said(scene, "load") == (sentence if is_late else None)


@pytest.mark.parametrize(
    ("after_us", "is_said"), [(2 * SECOND_US - 1, True), (2 * SECOND_US, False)]
)
def test_it_is_named_while_it_is_still_at_it(after_us: int, is_said: bool) -> None:
    """Two seconds after its rest it has nothing more to compute."""
    scene = RobotScene()
    computed(scene, OPTIMIZER, 0.5)
    scene.later(4 * 0.5)
    scene.utime += after_us
    assert (said(scene, "load") is not None) is is_said


def test_ranges_that_there_is_no_room_for_are_counted() -> None:
    scene = RobotScene()
    scene.robot.back.estimate = TeamEstimate(Segment(0, 1, 0), {}, left_out=993)
    few = "ranges of 993 pairs are left out, to bound memory: the team is large"
    assert said(scene, "load") == few
    computed(scene, OPTIMIZER, 0.5)
    assert str(said(scene, "load")).endswith(f"or other programs take it; {few}")


def test_both_modules_that_take_long_may_be_named() -> None:
    scene = RobotScene(extra="[relative_pose]\nrate_hz = 2.0\n")
    computed(scene, OPTIMIZER, 0.6)
    computed(scene, RELATIVE_POSE, 0.3)
    assert str(said(scene, "load")).startswith(
        "relative_pose runs every 1.5 s instead of every 0.5 s, "
        "optimizer runs every 3.0 s instead of every 1.0 s, to leave"
    )


# why a robot is not localised: the first stage at which it stops


def test_a_robot_that_is_localised_is_asked_nothing() -> None:
    scene = RobotScene()
    scene.drive(1)
    scene.localise()
    assert said(scene, "pose") is None


def test_alone_it_asks_whether_the_others_run() -> None:
    sentence = why(RobotScene())
    assert sentence.startswith("not localised: no other robot is heard; is drslamd running")
    assert "gossip.group" in sentence


@pytest.mark.parametrize(("after_us", "is_patient"), [(3 * SECOND_US, True), (3_000_001, False)])
def test_nobody_is_missed_before_others_had_time_to_speak(after_us: int, is_patient: bool) -> None:
    scene = RobotScene()
    scene.robot.handle(NetworkState(scene.utime, True))
    scene.utime += after_us
    assert ("has just been joined" in why(scene)) is is_patient
    assert ("no other robot is heard" in why(scene)) is not is_patient


def test_of_peers_that_do_not_hear_it_the_other_direction_is_asked_for() -> None:
    scene = RobotScene()
    for peer in (7, 4):
        scene.meet(peer, hears_us=False)
    assert why(scene) == (
        "not localised: robots 4, 7 are heard but do not hear this one; is multicast let through "
        "in both directions?"
    )


def test_peers_that_fell_silent_do_not_hear_it() -> None:
    scene = RobotScene()
    scene.meet(4)
    scene.later(10)
    assert "robots 4 are heard but do not hear this one" in why(scene)


def test_without_ranges_the_modules_are_asked_for() -> None:
    scene = RobotScene()
    scene.meet(7)
    scene.meet(4)
    scene.meet(5, hears_us=False)
    assert why(scene) == (
        "not localised: no ranges to robots 4, 7; are their modules on, in the same DR mode and of "
        "one firmware, and is uwb.id right on every robot?"
    )


@pytest.mark.parametrize("is_ranged", [True, False])
def test_without_odometry_nothing_follows_from_ranges(is_ranged: bool) -> None:
    """Whichever side measures them."""
    scene = RobotScene()
    scene.meet(4, ranges_to_us=not is_ranged)
    if is_ranged:
        scene.range_to(4)
    assert why(scene) == "not localised: no odometry yet"


def test_where_others_make_the_closures_they_are_named() -> None:
    scene = RobotScene(robot=9)
    scene.drive(1)
    for peer in (7, 4):
        scene.meet(peer, ranges_to_us=True)
    assert why(scene) == (
        "not localised: closures with this robot are made by robots 4, 7; ask them"
    )


def with_pair(*peers: int) -> RobotScene:
    """A robot that drives in range of peers, and owns the pairs with them."""
    scene = RobotScene()
    scene.drive(1)
    for peer in peers:
        scene.meet(peer)
        scene.range_to(peer)
        scene.own_pair(peer)
    return scene


def told(reason: str) -> str:
    return f"not localised: {reason}; drive curves, and not side by side"


def answered(scene: RobotScene, peer: int, *counts: int) -> None:
    """Windows with so many poses each."""
    for count in counts:
        scene.robot.front.pairs[peer].on_estimate(asked_at(10), estimate_of(*[BESIDE] * count))


def test_a_pair_without_a_window_says_that_nothing_was_measured() -> None:
    assert why(with_pair(4)) == told("nothing measured yet (with robot 4)")


def test_each_pair_says_what_became_of_its_last_window() -> None:
    scene = with_pair(4, 7)
    answered(scene, 4, 0)
    scene.robot.front.pairs[7].count("too few ranges")
    assert why(scene) == told("not enough motion (with robot 4), too few ranges (with robot 7)")


def test_a_pair_with_a_peer_that_is_gone_says_nothing() -> None:
    scene = with_pair(4, 7)
    scene.hear(7, a_status((Heard(0, 1, 0),), uwb_id=7, leaving=True))
    assert why(scene) == told("nothing measured yet (with robot 4)")


@pytest.mark.parametrize("poses", [1, 2])
def test_a_window_that_named_a_pose_is_no_reason(poses: int) -> None:
    """Unique or ambiguous: what lacks then is agreement."""
    scene = with_pair(4)
    answered(scene, 4, 1, 1, poses)
    assert why(scene) == told(
        "0 of 3 closures agree, 5 must and outnumber all others (with robot 4)"
    )


@pytest.mark.parametrize(("kept", "is_said"), [(4, False), (5, True)])
def test_closures_that_agree_wait_for_the_proof_that_no_wheel_runs_backwards(
    kept: int, is_said: bool
) -> None:
    scene = with_pair(4)
    answered(scene, 4, *[1] * 5)
    pair = scene.robot.front.pairs[4]
    pair.kept = cast(Any, (object(),) * kept)
    assert ("would fit wheels that run backwards" in why(scene)) is is_said
    pair.search.is_confirmed = True
    assert "run backwards" not in why(scene)


@pytest.mark.parametrize("kept", [4, 5])
def test_or_for_windows_that_would_rather_have_another_track(kept: int) -> None:
    """Only where enough agree: what lacks else is agreement."""
    scene = with_pair(4)
    answered(scene, 4, *[1] * 5)
    pair = scene.robot.front.pairs[4]
    pair.kept = cast(Any, (object(),) * kept)
    pair.search._is_rather_another = True
    pair.search._answers.extend(cast(Any, (object(),) * MOST_ASKED))
    rather = "the same ranges would rather fit wheels of another track or size" in why(scene)
    assert rather is (kept == 5)
    assert "run backwards" not in why(scene)
    pair.search.is_confirmed = True
    assert "rather" not in why(scene)


def test_when_windows_fail_after_some_that_did_not_the_last_one_is_the_reason() -> None:
    scene = with_pair(4)
    answered(scene, 4, 1, 1, 0)
    assert why(scene) == told("not enough motion (with robot 4)")


def test_the_agreement_is_that_of_the_configured_algorithm() -> None:
    scene = RobotScene(extra='[relative_pose]\nalgorithm = "paper"\n')
    scene.drive(1)
    scene.meet(4)
    scene.range_to(4)
    scene.own_pair(4)
    answered(scene, 4, 1)
    assert "0 of 1 closures agree, 2 must" in why(scene)


def test_a_pair_that_is_connected_waits_for_the_graph() -> None:
    scene = with_pair(4)
    answered(scene, 4, 1)
    scene.robot.front.pairs[4].connected = True
    assert why(scene) == told("connected, the graph is about to be solved (with robot 4)")


def test_who_began_again_says_that_it_looks_for_its_place() -> None:
    scene = RobotScene()
    scene.robot.back.onlooked = TeamEstimate(Segment(1, 1, 0), {})
    assert "its last start was" in why(scene)
    scene.robot.front.resumption.verdict = "not enough motion"
    assert "the place of this one (not enough motion); drive a metre" in why(scene)
