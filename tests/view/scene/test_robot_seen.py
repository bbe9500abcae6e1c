"""How a robot is, in words, from what it says itself."""

from __future__ import annotations

from dataclasses import replace

import pytest
from onlooked_team import Actor

from drslamd.conventions import Chain
from drslamd.gossip.message_types import LogState, PoseState
from drslamd.view.scene.robot_seen import RobotSeen, names, picture, sentences

T = 100.0


def seen_as(actor: Actor, t: float = T) -> RobotSeen:
    seen = RobotSeen(actor.chain, t - 50)
    seen.heard, seen.status, seen.state = t, actor.status(), actor.state
    return seen


def team(*actors: Actor) -> dict[int, RobotSeen]:
    return {actor.robot: seen_as(actor) for actor in actors}


def said(of: dict[int, RobotSeen], robot: int, t: float = T) -> list[str]:
    return sentences(of[robot], of, t)


def test_of_a_robot_that_is_well_nothing_is_said() -> None:
    assert said(team(Actor(0, peers=(1,)), Actor(1, peers=(0,))), 0) == []


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (PoseState.NOT_LOCALISED, "is not localised yet"),
        (PoseState.DOUBTFUL, "is in doubt"),
        (PoseState.STALE, "has no odometry"),
    ],
)
def test_a_state_has_its_sentence(state: PoseState, words: str) -> None:
    of = team(Actor(0, peers=(1,), state=state), Actor(1, peers=(0,)))
    (sentence,) = said(of, 0)
    assert sentence.startswith(words)


@pytest.mark.parametrize(("silent", "is_lost"), [(4.9, False), (5.0, True)])
def test_five_seconds_of_silence_are_a_loss(silent: float, is_lost: bool) -> None:
    of = team(Actor(0, peers=(1,)), Actor(1, peers=(0,)))
    assert of[0].speaks(T + silent) is not is_lost
    words = said(of, 0, T + silent)
    assert words == (["is not heard any more: switched off, or out of reach"] if is_lost else [])


def test_a_goodbye_is_no_loss() -> None:
    of = team(Actor(0, peers=(1,)), Actor(1, peers=(0,)))
    of[0].status = Actor(0).status(leaving=True)
    assert said(of, 0) == ["has said goodbye"]
    assert said(of, 0, T + 60) == ["has said goodbye"]
    assert said(of, 1) == []


def test_who_hears_nobody_is_told_to_look_at_the_network_first() -> None:
    words = said(team(Actor(0), Actor(1, peers=(0,))), 0)
    assert words[0].startswith("hears no other robot")
    assert words[1].startswith("measures ranges to nobody")


def test_who_is_alone_is_not_blamed_for_hearing_nobody() -> None:
    assert said(team(Actor(0)), 0) == []


def test_multicast_that_passes_one_way_is_named() -> None:
    of = team(Actor(0, peers=(1, 2)), Actor(1), Actor(2, peers=(0, 1)))
    assert said(of, 0) == ["hears robot 1 but is not heard there: multicast passes one way"]


def test_two_robots_with_one_module_are_named() -> None:
    of = team(Actor(0, peers=(1,), uwb_id=8), Actor(1, peers=(0,), uwb_id=8))
    assert said(of, 1) == ["claims UWB module 8, as robot 0 does"]


def test_entries_that_lack_are_counted() -> None:
    of = team(Actor(0, peers=(1,)), Actor(1, peers=(0,)))
    logs = (LogState(0, 5, 0, 4, 4), LogState(1, 5, 0, 6, 9))
    assert of[0].status is not None
    of[0].status = replace(of[0].status, logs=logs)
    assert said(of, 0) == ["waits for 3 messages of the others' logs"]
    assert picture(of[0], of, T)["lacks"] == 3


@pytest.mark.parametrize(("since", "is_said"), [(59.0, True), (60.0, False)])
def test_another_start_is_spoken_of_for_a_minute(since: float, is_said: bool) -> None:
    of = team(Actor(0, peers=(1,)), Actor(1, peers=(0,)))
    of[0].begin_again(Chain(0, 6), T - since)
    of[0].status, of[0].state = Actor(0, peers=(1,)).status(), PoseState.LOCALISED
    words = said(of, 0)
    assert words == ([f"began again {since:.0f} s ago"] if is_said else [])


def test_without_a_heartbeat_nothing_else_is_guessed() -> None:
    seen = RobotSeen(Chain(0, 5), 0.0)
    seen.state = PoseState.LOCALISED
    assert sentences(seen, {0: seen}, 1.0) == ["no heartbeat of it was heard yet"]


def test_sigma_is_that_of_the_worst_direction() -> None:
    seen = seen_as(Actor(0, covariance=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)))
    assert seen.sigma_m is None
    seen.path.add(Actor(0, covariance=(0.05, 0.04, 0, 0.05, 0, 1)).pose(0), 0.0, 0.0)
    assert seen.sigma_m == pytest.approx(0.3)
    assert picture(seen, {0: seen}, T)["sigma_m"] == 0.3


@pytest.mark.parametrize(
    ("robots", "text"),
    [([3], "robot 3"), ([5, 3], "robots 3 and 5"), ([1, 2, 3, 4, 5], "5 robots")],
)
def test_names(robots: list[int], text: str) -> None:
    assert names(robots) == text
