"""What the page is told: what is new as it comes, and all of it when a page comes."""

from __future__ import annotations

import ast
import json
import math
import time
from pathlib import Path
from typing import Any

import pytest
from machine_speed import allowed_s
from onlooked_team import Actor, entry, two
from places import REPOSITORY

from drslamd.conventions import Chain
from drslamd.gossip.message_types import PoseState
from drslamd.view.scene.scene import FORGET_S, MAX_PAIRS, MAX_ROBOTS, WAITING, Scene

Update = dict[str, Any]


def drive(
    scene: Scene,
    actors: tuple[Actor, ...],
    begin: int,
    end: int,
    off_m: float = 0.0,
    every: int = 5,
) -> None:
    """Everybody drives; the first ranges to the second twice a second."""
    a, b = actors[:2]
    for k in range(10 * begin, 10 * end):
        t = k / 10
        for actor in actors:
            if k % 10 == 0:
                scene.take(actor.said(actor.status(), t), t)
                scene.take(actor.said(entry(k, (actor.keyframe(t),)), t), t)
            if k % every == 0:
                scene.take(actor.said(actor.pose(t), t), t)
        if k % 5 == 0 and k:
            ranges = (a.range_to(b, t - 0.5, off_m),)
            scene.take(a.said(entry(k, (), ranges), t), t)


def all_of(scene: Scene, t: float) -> Update:
    """What a page that has just come knows in the end."""
    out: Update = {"paths": {}, "pairs": [], "closures": []}
    for piece in scene.everything(t):
        json.dumps(piece, allow_nan=False)
        out["paths"] |= piece.get("paths", {})
        for name in ("pairs", "closures"):
            out[name] += piece.get(name, [])
        out |= {name: piece[name] for name in ("t", "robots", "not_shown") if name in piece}
    return out


def test_a_pose_is_told_once_with_its_state_and_covariance() -> None:
    scene, (a, _) = Scene(), two()
    scene.take(a.said(a.pose(0.0), 0.0), 0.0)
    assert list(scene.changes(0.0, False)["paths"]) == ["0"]
    scene.take(a.said(a.pose(1.0), 1.0), 1.0)
    (row,) = scene.changes(1.0, False)["poses"]
    x, y, theta = a.truth(1.0)
    assert row == pytest.approx([0, 1.0, x, y, theta, 1, 0.04, 0.01, 0.01], abs=1e-3)
    assert scene.changes(1.1, False) == {"t": 1.1}


def test_a_heading_that_is_not_known_is_none() -> None:
    scene, actor = Scene(), Actor(0, state=PoseState.POSITION)
    scene.take(actor.said(actor.pose(0.0), 0.0), 0.0)
    ((_, x, _, theta, state, *_),) = scene.changes(0.0, False)["paths"]["0"]
    assert (x, theta, state) == (pytest.approx(2.0), None, 4)


def test_a_pose_that_was_old_when_it_was_said_is_shown_where_it_belongs_in_time() -> None:
    scene, (a, _) = Scene(), two()
    scene.take(a.said(a.pose(1.0), 1.8), 2.0)
    assert all_of(scene, 2.0)["paths"]["0"][0][0] == pytest.approx(1.2)
    liar = Actor(3)
    scene.take(liar.said(liar.pose(-900.0), 2.0), 2.0)
    assert all_of(scene, 2.0)["paths"]["3"][0][0] == -3.0


def test_a_pose_that_says_nothing_moves_nobody() -> None:
    scene, actor = Scene(), Actor(0, state=PoseState.NOT_LOCALISED)
    scene.take(actor.said(actor.pose(0.0), 0.0), 0.0)
    assert scene.changes(0.0, False) == {"t": 0.0}


@pytest.mark.parametrize("off_m", [0.0, 0.4])
def test_true_paths_and_true_ranges_leave_no_scatter_and_the_bias_is_found(off_m: float) -> None:
    scene, (a, b) = Scene(), two()
    drive(scene, (a, b), 0, 30, off_m)
    ((low, high, t, rms, bias),) = scene.changes(30.0, True)["pairs"]
    assert (low, high, t) == (0, 1, 30.0)
    assert rms < 0.01
    assert bias == pytest.approx(-off_m, abs=0.01)


def test_ranges_that_no_longer_fit_scatter() -> None:
    scene, (a, b) = Scene(), two()
    drive(scene, (a, b), 0, 60)
    scene.changes(60.0, True)
    drive(scene, (a, b), 60, 90, off_m=0.7)
    ((*_, rms, bias),) = scene.changes(90.0, True)["pairs"]
    assert rms == pytest.approx(0.7, abs=0.02)
    assert bias == pytest.approx(0.0, abs=0.02)


def test_a_closure_and_its_withdrawal_are_told_with_their_ends() -> None:
    scene, (a, b) = Scene(), two()
    drive(scene, (a, b), 0, 10)
    closures = a.closure_to(b, 5.0, 3), b.closure_to(a, 6.0, 3, kept=False, off_m=2.0)
    scene.take(a.said(entry(900, (), (), closures[:1]), 10), 10.0)
    scene.take(b.said(entry(900, (), (), closures[1:]), 10), 10.0)
    one, other = scene.changes(10.0, True)["closures"]
    ends = [*a.truth(5.0)[:2], *b.truth(5.0)[:2]]
    assert one == pytest.approx([0, 1, 3, 10.0, 1, *ends, 0.0], abs=0.01)
    assert other[:5] == [1, 0, 3, 10.0, 0]
    assert other[-1] == pytest.approx(2.0, abs=0.02)
    assert sorted(all_of(scene, 11.0)["closures"]) == sorted([one, other])
    assert "closures" not in scene.changes(11.0, True)


def test_measurements_wait_for_their_paths_but_not_for_ever() -> None:
    scene, (a, b) = Scene(), two()
    drive(scene, (a, b), 0, 5)
    for k, ahead in enumerate((2.0, 50.0)):
        scene.take(a.said(entry(900 + k, (), (), (a.closure_to(b, 5 + ahead, k),)), 5), 5.0)
    assert "closures" not in scene.changes(5.0, True)
    drive(scene, (a, b), 5, 8)
    (row,) = scene.changes(8.0, True)["closures"]
    assert row[2] == 0
    scene.changes(12.0, True)
    assert not scene._waiting
    for k in range(2 * WAITING):
        scene.take(a.said(entry(k, (), (), (a.closure_to(b, 90.0, k),)), 12), 12.0)
    assert len(scene._waiting) == WAITING


def test_a_page_that_comes_late_is_told_the_same_as_one_that_was_there() -> None:
    scene, (a, b) = Scene(), two()
    told: dict[str, list[Any]] = {}
    for second in range(40):
        drive(scene, (a, b), second, second + 1, every=10)
        update = scene.changes(second + 1.0, True)
        for robot, rows in update.get("paths", {}).items():
            told[robot] = rows
        for robot, *row in update.get("poses", []):
            told.setdefault(str(robot), []).append(row)
    everything = all_of(scene, 40.0)
    assert set(everything["paths"]) == set(told) == {"0", "1"}
    for robot, rows in everything["paths"].items():
        times = {row[0] for row in rows}
        assert len(times & {row[0] for row in told[robot]}) > 30
    assert [r["id"] for r in everything["robots"]] == [0, 1]
    assert everything["pairs"]


def test_another_start_voids_closures_but_not_the_path() -> None:
    scene, (a, b) = Scene(), two()
    drive(scene, (a, b), 0, 10)
    scene.take(a.said(entry(900, (), (), (a.closure_to(b, 5.0, 3),)), 10), 10.0)
    scene.changes(10.0, True)
    again = Actor(1, epoch=6, ahead_s=1.0, centre=b.centre, turning=b.turning)
    scene.take(again.said(again.status(), 11.0), 11.0)
    update = scene.changes(11.0, True)
    assert update["forget"] == [(0, 1)]
    assert all_of(scene, 11.0)["closures"] == []
    assert len(all_of(scene, 11.0)["paths"]["1"]) > 5
    assert update["robots"][1]["words"]


def test_an_entry_of_another_start_changes_nothing() -> None:
    scene, (a, _) = Scene(), two()
    old = Actor(0, epoch=4)
    scene.take(old.said(entry(0, (old.keyframe(0),)), 0), 0.0)
    assert not scene.robots
    scene.take(a.said(a.status(), 0), 0.0)
    scene.take(old.said(entry(1, (old.keyframe(0),)), 0), 0.0)
    assert scene.robots[0].chain == Chain(0, 5)


def test_robots_beyond_the_bound_are_counted_until_somebody_was_silent_for_long() -> None:
    scene = Scene()
    for robot in range(MAX_ROBOTS + 3):
        actor = Actor(robot)
        scene.take(actor.said(actor.status(), 0), float(robot))
    assert len(scene.robots) == MAX_ROBOTS
    assert scene.changes(70.0, True)["not_shown"] == 3
    late = Actor(200)
    scene.take(late.said(late.status(), 0), FORGET_S - 0.1)
    assert 200 not in scene.robots
    scene.take(late.said(late.status(), 0), FORGET_S)
    assert 200 in scene.robots
    assert 0 not in scene.robots
    assert scene.changes(FORGET_S, True)["forget"] == [(0,)]


def test_starts_that_follow_each_other_without_end_are_forgotten_once() -> None:
    scene, (a, b) = Scene(), two()
    drive(scene, (a, b), 0, 10)
    scene.changes(10.0, True)
    for epoch in range(6, 1_000):
        again = Actor(1, epoch=epoch)
        scene.take(again.said(again.status(), 10.0), 10.0)
    assert scene.changes(11.0, True)["forget"] == [(0, 1)]


def test_pairs_are_bounded() -> None:
    scene = Scene()
    for a in range(40):
        for b in range(a):
            scene._pair(a, b)
    assert len(scene.pairs) == MAX_PAIRS < 40 * 39 / 2


def test_robots_in_two_frames_leave_no_residual() -> None:
    scene, (a, b) = Scene(), two()
    b.frame = Chain(1, 5)
    drive(scene, (a, b), 0, 20)
    assert "pairs" not in scene.changes(20.0, True)


@pytest.mark.slow
def test_a_second_of_twenty_robots_takes_less_than_a_tenth_of_one() -> None:
    scene = Scene()
    team = tuple(Actor(k, centre=(3.0 * k, 0.0), ahead_s=100.0 * k) for k in range(20))
    drive(scene, team, 0, 20)
    began = time.process_time()
    for second in range(20, 30):
        drive(scene, team, second, second + 1)
        for tenth in range(10):
            json.dumps(scene.changes(second + tenth / 10, tenth == 9))
    took = time.process_time() - began
    assert took / 10 < allowed_s(0.1)


def test_the_scene_knows_no_clock_no_socket_and_no_file() -> None:
    impure = {"asyncio", "socket", "time", "os", "pathlib", "aiohttp", "threading", "random"}
    for path in (REPOSITORY / "drslamd" / "view" / "scene").glob("*.py"):
        assert not imported(path) & impure, path
        assert not any(name.startswith("drslamd.io") for name in whole_names(path)), path


def whole_names(path: Path) -> set[str]:
    nodes = list(ast.walk(ast.parse(path.read_text())))
    plain = {alias.name for n in nodes if isinstance(n, ast.Import) for alias in n.names}
    return plain | {n.module for n in nodes if isinstance(n, ast.ImportFrom) and n.module}


def imported(path: Path) -> set[str]:
    return {name.split(".")[0] for name in whole_names(path)}


def test_the_truth_of_the_made_up_team_is_a_circle() -> None:
    """The oracle's own eyes."""
    a, _ = two()
    assert math.dist(a.truth(0)[:2], (2, 0)) < 1e-12
    assert a.truth(0)[2] == pytest.approx(math.pi / 2)
