"""A robot drives on after a hole: until when its placing says where it is, and what it tells."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from resumed_scene import BEGAN, FRAME, OWN, PEERS, UNTIL, W_T_O, ResumedScene, driven, keyframe

from drslamd.conventions import GRID_US, SECOND_US, Segment
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import GraphEntry
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relocation.question import Found
from drslamd.slam.relocation.relocation import AGAIN_US, SETTLES_US, Relocation
from drslamd.slam.relocation.sightings import Own
from drslamd.slam.robot_model import UNTOLD

SOLVED_N, SILENT_N = 50, 60
NOW = UNTIL * GRID_US


class HoleScene(ResumedScene):
    """Its wheels were silent from sample 60 to 100, and it has driven eight seconds since."""

    def __init__(self) -> None:
        super().__init__(None)
        self.track = Track(1_000)
        for n in (*range(SOLVED_N, SILENT_N), *range(BEGAN, UNTIL)):
            self.track.append(n, np.round(driven(max(n, BEGAN)) / RESOLUTION))
        self.graph.insert(OWN, GraphEntry(1, keyframes=(keyframe(BEGAN),)))
        self.relocation = Relocation(Own(OWN.robot, UNTOLD, 0.1, LINKTRACK))
        for half_s in range(14, 36):
            self.ask(utime=half_s * SECOND_US // 2)

    def ask(
        self, estimate: TeamEstimate | None = None, utime: int = NOW
    ) -> Callable[[], Found] | None:
        team = estimate or solved_until(SOLVED_N)
        return self.relocation.look(
            self.neighbours, self.ranges, self.track, self.graph, team, lambda: 0.6, utime
        )

    def tells(self, ago_us: int = 0, estimate: TeamEstimate | None = None) -> bool:
        """Does it, of an answer that came so long ago?"""
        run = self.ask(estimate)
        assert run is not None
        return self.relocation.on_found(run(), self.own, NOW - ago_us)


def solved_until(n: int, sigma_rad: float = 0.01, frame: Segment = FRAME) -> TeamEstimate:
    """Our last solved keyframe is n, and our heading is known so well."""
    ends = {c.robot: Trajectory(c, np.array([20]), np.array([[*p, 0.0]])) for c, p in PEERS.items()}
    pose = se2.compose(W_T_O, driven(max(n, BEGAN)))
    ends[OWN.robot] = Trajectory(OWN, np.array([n]), pose[None])
    joint = 1e-4 * np.eye(9)
    joint[8, 8] = sigma_rad**2
    return TeamEstimate(frame, ends, joint)


def test_who_is_placed_is_where_the_placing_has_it_before_module_3_knows() -> None:
    scene = HoleScene()
    assert scene.relocation.placed(solved_until(SOLVED_N), scene.track) is None
    assert scene.tells()
    now = scene.relocation.placed(solved_until(SOLVED_N), scene.track)
    assert now is not None
    assert now.utime == (UNTIL - 1) * GRID_US
    true = se2.compose(W_T_O, driven(UNTIL - 1))
    error = now.pose - true
    error[2] = se2.wrap(error[2])
    assert float(error @ np.linalg.solve(now.covariance, error)) < 11.34
    assert np.sqrt(now.covariance[2, 2]) < np.radians(10)
    elsewhere = solved_until(SOLVED_N, frame=Segment(2, 9, 0))
    assert scene.relocation.placed(elsewhere, scene.track) is None


@pytest.mark.parametrize(("ago_us", "is_told"), [(AGAIN_US - 1, False), (AGAIN_US, True)])
def test_a_placing_is_asked_again_and_told_once_in_four_seconds(ago_us: int, is_told: bool) -> None:
    scene = HoleScene()
    assert scene.tells(ago_us)
    assert scene.tells() is is_told
    assert len(scene.relocation.tell()) == 1 + is_told


def test_what_module_3_has_is_not_told_again() -> None:
    scene = HoleScene()
    assert scene.tells(AGAIN_US)
    assert not scene.tells(estimate=solved_until(170, sigma_rad=0.5))


@pytest.mark.parametrize(
    ("share", "ago_us", "is_lost"),
    [
        (1.01, SECOND_US, True),
        (0.99, SECOND_US, False),
        (1.01, SETTLES_US - 1, True),
        (1.01, SETTLES_US, False),
    ],
)
def test_module_3_takes_over_when_it_knows_the_heading_as_well_or_after_ten_seconds(
    share: float, ago_us: int, is_lost: bool
) -> None:
    scene = HoleScene()
    assert scene.tells(ago_us)
    placed = scene.relocation._placed
    assert placed is not None
    sigma = share * float(np.sqrt(placed.covariance[2, 2]))
    scene.ask(solved_until(170, sigma))
    assert scene.relocation.is_lost is is_lost


def test_an_answer_that_does_not_stand_is_no_pose_any_more() -> None:
    scene = HoleScene()
    assert scene.tells()
    run = scene.ask()
    assert run is not None
    doubtful = run()
    scene.relocation.on_found(
        Found(doubtful.estimate, BEGAN, (), "ambiguous", doubtful.seen), scene.own, NOW
    )
    assert scene.relocation.placed(solved_until(SOLVED_N), scene.track) is None
