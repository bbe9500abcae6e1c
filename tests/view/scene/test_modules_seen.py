"""Modules that stand without a robot, where robots say that they stand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from onlooked_team import Actor, entry
from slam_scenes import inverted, product

from drslamd.conventions import node_chain
from drslamd.slam.graph.measurements import ClosureMeasurement, RangeMeasurement
from drslamd.view.scene import modules_seen
from drslamd.view.scene.scene import Scene

HEADING = (math.pi**2) / 3
FIRST = (4.0, 1.0)


def module_at(
    actor: Actor, t: float, place: tuple[float, float], number: int = 0, b_n: int = 0
) -> ClosureMeasurement:
    """Module 101 stands at a place of the team's frame, seen from the actor at t."""
    x, y, _ = product(inverted(actor.truth(t)), (*place, 0.0))
    covariance = (0.04, 0.0, 0.0, 0.01, 0.0, HEADING)
    return ClosureMeasurement(
        number, True, actor.n(t), node_chain(101), b_n, (x, y, 0.0), covariance
    )


def driven(*actors: Actor, until: int = 20) -> Scene:
    """A scene in which they say their poses twice a second."""
    scene = Scene()
    for k in range(2 * until):
        for actor in actors:
            scene.take(actor.said(actor.pose(k / 2), k / 2), k / 2)
    return scene


def tell(scene: Scene, actor: Actor, closure: ClosureMeasurement, t: float = 20.0) -> None:
    scene.take(actor.said(entry(closure.number, closures=(closure,)), t), t)


def shown(scene: Scene, t: float = 20.0) -> list[list[object]]:
    rows: list[list[object]] = scene.changes(t, True)["modules"]
    return rows


def test_a_module_is_shown_where_it_stands_with_its_sigma() -> None:
    actor = Actor(0)
    scene = driven(actor)
    assert shown(scene) == []
    tell(scene, actor, module_at(actor, 10.0, FIRST))
    ((uwb_id, frame, x, y, sigma),) = shown(scene)
    assert (uwb_id, frame) == (101, "0/5")
    assert (x, y) == pytest.approx(FIRST, abs=0.02)
    assert sigma == 0.2
    (piece, *_) = scene.everything(20.0)
    assert piece["modules"] == [[101, "0/5", x, y, 0.2]]


def test_a_module_that_was_moved_is_gone_until_it_is_found_anew() -> None:
    actor = Actor(0)
    scene, first = driven(actor), module_at(actor, 10.0, FIRST, number=3)
    tell(scene, actor, first)
    tell(scene, actor, replace(first, number=2, kept=False))
    assert len(shown(scene)) == 1, "another one was withdrawn"
    tell(scene, actor, replace(first, kept=False))
    assert shown(scene) == []


def test_of_several_that_tell_of_one_the_newest_place_counts() -> None:
    one, other = Actor(0), Actor(1, centre=(5.0, 1.0))
    scene = driven(one, other)
    tell(scene, other, module_at(other, 10.0, (-2.0, 5.0), b_n=1))
    tell(scene, one, module_at(one, 12.0, FIRST, b_n=0))
    ((_, _, x, y, _),) = shown(scene)
    assert (x, y) == pytest.approx((-2.0, 5.0), abs=0.02)


def test_it_is_carried_along_when_the_frame_changes() -> None:
    actor = Actor(0)
    scene = driven(actor)
    tell(scene, actor, module_at(actor, 10.0, FIRST))
    shown(scene)
    # two seconds after its last pose it is in a frame that lies elsewhere, and turned
    x, y, theta = product((10.0, -3.0, 1.2), actor.truth(20.0)).tolist()
    for t in (19.0, 19.4, 20.0):
        scene.take(actor.said(entry(30 + round(t), (actor.keyframe(t),)), t), t)
    pose = replace(actor.pose(20.0), frame=4, frame_epoch=9, pose=(x, y, theta))
    scene.take(actor.said(pose, 20.0), 20.0)
    ((_, frame, *there, _),) = shown(scene)
    assert frame == "4/9"
    assert there == pytest.approx(product((10.0, -3.0, 1.2), (*FIRST, 0.0))[:2], abs=0.05)


def test_after_an_hour_it_is_where_it_was() -> None:
    """Its robot no longer knows where it was itself then."""
    actor = Actor(0)
    scene = driven(actor)
    tell(scene, actor, module_at(actor, 10.0, FIRST))
    before = shown(scene)
    scene.robots[0].path._rows.clear()
    assert shown(scene, 21.0) == before


def test_what_an_earlier_start_of_a_robot_said_is_void() -> None:
    actor = Actor(0)
    scene = driven(actor)
    tell(scene, actor, module_at(actor, 10.0, FIRST))
    again = Actor(0, epoch=6)
    scene.take(again.said(again.status(), 20.0), 20.0)
    assert shown(scene) == []


def test_ranges_to_a_module_are_nothing_that_waits() -> None:
    actor = Actor(0)
    scene = driven(actor)
    nowhere = (0.0, 0.0)
    to = RangeMeasurement(actor.n(10.0), node_chain(101), 0, nowhere, nowhere, 3.0, 0.1)
    scene.take(actor.said(entry(1, ranges=(to,)), 20.0), 20.0)
    shown(scene)
    assert len(scene._waiting) == 0


def test_no_more_modules_are_remembered_than_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(modules_seen, "MOST", 3)
    actor = Actor(0)
    scene = driven(actor)
    for uwb_id in range(5):
        closure = module_at(actor, 10.0, FIRST, number=uwb_id)
        tell(scene, actor, replace(closure, peer=node_chain(uwb_id)))
    assert [row[0] for row in shown(scene)] == [2, 3, 4]
