"""Keyframes of several chains, looked for and carried at once."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from long_drives import A, aged, chain_of
from slam_scenes import NOISE, Array, wander

from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.graph.thinning.team_chains import TeamChains
from drslamd.slam.graph.timed_rows import NEVER
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.robot_model import RobotModel

WAYS = [wander(np.random.default_rng(seed), 2_000, 0.3) for seed in (1, 2)]
ALL = (0, NEVER)


def _place(way: Array, second: float) -> Array:
    return np.asarray(way[int(second)])


def views() -> dict[int, ChainView]:
    """Of robots 3 and 5, the second one's wheels worse."""
    out = {}
    for robot, way, worse in zip((3, 5), WAYS, (1.0, 2.0), strict=True):
        data = chain_of(range(2_000), partial(_place, way))
        scale, yaw, shift, turn = (worse * value for value in NOISE.by_wheels)
        data.take_model(0, RobotModel(OdometryNoise(scale, yaw, shift, turn)))
        out[robot] = aged(data)
    assert out[3].chain == A
    return out


def test_a_keyframe_is_found_in_its_own_chain_only() -> None:
    found = TeamChains(views(), {3: (18_000, 18_995), 5: (18_500, NEVER)})
    first, second = found.numbers([3, 5]).tolist()
    which = np.array([first, first, first, second, second, second])
    ends = found.find(which, np.array([18_990.0, 18_995.0, 19_000.0, 18_490.0, 18_500.0, 19_990.0]))
    assert ends.there.tolist() == [True, False, False, False, True, True]
    assert found.chain[ends.rows[ends.there]].tolist() == [first, second, second]
    assert found.n[ends.rows[ends.there]].tolist() == [18_990, 18_500, 19_990]
    none = TeamChains(views(), {3: (30_000, 30_001)})
    assert not none.find(np.array([0]), np.array([10.0])).there.any()


@pytest.mark.parametrize("span", [(0, 0), (410, 1_210), (13_330, 16_670), (16_900, 19_990)])
def test_what_is_carried_does_not_depend_on_what_else_is_there(span: tuple[int, int]) -> None:
    all_of, some = TeamChains(views(), {3: ALL, 5: ALL}), TeamChains(views(), {5: span, 3: (0, 9)})
    n = np.arange(span[0], span[1] + 1, 10).astype(float)
    seen = []
    for chains in (all_of, some):
        ends = chains.find(np.repeat(chains.numbers([5]), len(n)), n)
        assert ends.there.all()
        seen.append((chains.carried(ends.rows), chains.is_old[ends.rows]))
    (one, is_old), (other, was_old) = seen
    assert np.array_equal(is_old, was_old)
    for name in ("n", "keyframe_T_body", "sums", "is_after"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()


def test_rows_are_sorted_by_the_noise_of_their_robots() -> None:
    team = views()
    chains = TeamChains(team, {3: (0, 45), 5: (0, 25)})
    (one, first), (other, second) = chains.by_noise(np.array([7, 0, 3]))
    assert (one, other) == (team[3].model.noise, team[5].model.noise)
    assert chains.chain[[7, 0, 3]].tolist() == [1, 0, 0]
    assert (first.tolist(), second.tolist()) == ([1, 2], [0])
    alike = TeamChains({3: team[3]}, {3: (0, 45)})
    ((_, rows),) = alike.by_noise(np.array([0, 4]))
    assert rows.tolist() == [0, 1]
