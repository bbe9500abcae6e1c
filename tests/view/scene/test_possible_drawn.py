"""Where robots say that others may be: in which frame it is drawn, and how long."""

from __future__ import annotations

import math

import numpy as np
import pytest
from onlooked_team import Actor
from slam_scenes import inverted, product

from drslamd.gossip.message_types import Hypotheses, PoseState
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.view.scene.possible_drawn import possible
from drslamd.view.scene.possible_seen import HELD_S
from drslamd.view.scene.scene import Scene

KNOWN = (0.04, 0.0, 0.0, 0.01, 0.0, 0.01)
ODOMETRY = (3.0, -4.0, 1.0)
"""Where the frame of an actor's odometry lies in that of the team."""


def about(actor: Actor, t: float, *places: tuple[float, float, float], peer: int = 7) -> Hypotheses:
    """The actor is where it truly is; of the peer it names these places, in the team's frame."""
    utime = actor.n(t) * 100_000
    x, y, theta = product(inverted(ODOMETRY), actor.truth(t))
    seen = [product(inverted(ODOMETRY), place) for place in places]
    said = tuple(
        PossiblePlace(peer, utime, 1 / len(places), (p[0], p[1], p[2]), KNOWN) for p in seen
    )
    return Hypotheses(utime, (x, y, theta), said)


def heard(scene: Scene, actor: Actor, t: float, *places: tuple[float, float, float]) -> None:
    scene.take(actor.said(actor.status(), t), t)
    scene.take(actor.said(about(actor, t, *places), t), t)


def lost(robot: int) -> Actor:
    return Actor(robot, state=PoseState.NOT_LOCALISED)


def test_before_anybody_is_localised_it_is_the_odometry_of_the_lowest_that_says_some() -> None:
    scene = Scene()
    for robot in (2, 1):
        heard(scene, lost(robot), 10.0, (5.0, 1.0, 0.5))
    (shown,) = possible(scene.robots, 10.0)
    assert (shown["origin"], shown["frame_key"]) == (1, None)
    assert shown["here"] == pytest.approx(
        product(inverted(ODOMETRY), lost(1).truth(10.0)), abs=2e-3
    )
    ((peer, share, *pose, xx, xy, yy),) = shown["places"]
    assert (peer, share) == (7, 1.0)
    assert pose == pytest.approx(product(inverted(ODOMETRY), (5.0, 1.0, 0.5)), abs=2e-3)
    assert (xx, xy, yy) == (0.04, 0.0, 0.01)


def test_of_a_localised_robot_places_are_in_the_frame_of_its_path() -> None:
    """By where it was in both frames at one time; covariances turn along."""
    scene, actor = Scene(), Actor(1)
    for k in range(4):
        t = 10.0 + k / 2
        scene.take(actor.said(actor.pose(t), t), t)
        heard(scene, actor, t, (5.0, 1.0, 0.5), (-5.0, 1.0, 3.0))
    (shown,) = possible(scene.robots, 11.5)
    assert (shown["origin"], shown["frame_key"]) == (1, "0/5")
    assert shown["here"] == pytest.approx(actor.truth(11.5), abs=0.02)
    first, second = shown["places"]
    assert first[:5] == pytest.approx([7, 0.5, 5.0, 1.0, 0.5], abs=0.02)
    assert second[:5] == pytest.approx([7, 0.5, -5.0, 1.0, 3.0], abs=0.02)
    cos, sin = math.cos(1.0), math.sin(1.0)
    turned = np.array([[cos, -sin], [sin, cos]]) @ np.diag([0.04, 0.01])
    turned = turned @ np.array([[cos, sin], [-sin, cos]])
    assert first[5:] == pytest.approx([turned[0, 0], turned[0, 1], turned[1, 1]], abs=1e-3)


def test_who_is_not_localised_in_a_team_that_is_has_no_frame_to_draw_in() -> None:
    scene, placed = Scene(), Actor(0)
    scene.take(placed.said(placed.pose(10.0), 10.0), 10.0)
    heard(scene, lost(1), 10.0, (5.0, 1.0, 0.5))
    assert possible(scene.robots, 10.0) == []


def test_what_is_not_said_again_is_settled() -> None:
    scene = Scene()
    heard(scene, lost(1), 10.0, (5.0, 1.0, 0.5))
    assert possible(scene.robots, 10.0 + HELD_S - 0.1) != []
    assert possible(scene.robots, 10.0 + HELD_S) == []


def test_another_start_of_a_robot_knows_nothing_of_the_first() -> None:
    scene = Scene()
    heard(scene, lost(1), 10.0, (5.0, 1.0, 0.5))
    again = Actor(1, epoch=6, state=PoseState.NOT_LOCALISED)
    scene.take(again.said(again.status(), 10.5), 10.5)
    assert possible(scene.robots, 10.5) == []


def test_the_page_is_told_every_second_and_the_robot_says_it_in_words() -> None:
    scene = Scene()
    heard(scene, lost(1), 10.0, (5.0, 1.0, 0.5), (5.0, -1.0, 0.5))
    told = scene.changes(10.0, True)
    assert [said["origin"] for said in told["possible"]] == [1]
    (words,) = (robot["words"] for robot in told["robots"])
    assert any(word.startswith("robot 7 is at one of 2 places") for word in words)
    assert "possible" not in scene.changes(10.1, False)
    assert scene.changes(20.0, True)["possible"] == []
    (piece, *_) = scene.everything(10.5)
    assert [said["origin"] for said in piece["possible"]] == [1]
