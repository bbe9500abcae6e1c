"""The bound, against all poses solved at once, numerical derivatives and wheels that err."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from lab.bound import cramer_rao
from lab.recordings import world
from lab.recordings.recording import Array

SCENE = world.Scene(robots=2, seconds=6.0, range_hz=10)


def driven(scene: world.Scene, seed: int = 3) -> Array:
    """(n, R, 3) true poses, one each step of the bound."""
    rng = np.random.default_rng(seed)
    every = round(cramer_rao.STEP_S / world.STEP_S)
    return np.stack([world.drive(rng, scene)[::every] for _ in range(scene.robots)], axis=1)


def at_once(truths: Array, scene: world.Scene, last: int) -> Array:
    """(n, 6, 6) covariances of poses by Gauss and Markov: every step's noise is an unknown."""
    step = cramer_rao._Transition(scene.odometry, scene.ranges, 2, 1)
    start = cramer_rao._start(scene.odometry, scene.ranges, 2, 1)
    sight = cramer_rao._sights(truths, [(0, 1)], step.size)
    size, n = step.size, len(truths)
    prior = np.zeros((n * size, n * size))
    reach = np.zeros((n, size, n * size))
    reach[0, :, :size], prior[:size, :size] = np.eye(size), start
    for k in range(1, n):
        f, q = step.step(truths[k - 1], truths[k])
        here = slice(k * size, (k + 1) * size)
        prior[here, here] = q
        reach[k] = f @ reach[k - 1]
        reach[k, :, here] = np.eye(size)
    h = np.concatenate([sight[k] @ reach[k] for k in range(last + 1)])
    noise = cramer_rao._white(scene) * np.eye(len(h))
    gain = np.linalg.solve(h @ prior @ h.T + noise, h @ prior).T
    left = prior - gain @ h @ prior
    return np.array([(r @ left @ r.T)[:6, :6] for r in reach])


def test_live_and_hindsight_are_those_of_all_noise_as_unknowns_at_once() -> None:
    truths = driven(SCENE)
    n = len(truths)
    found = cramer_rao.of_team(truths, SCENE, np.array([20, n - 1]))
    whole = at_once(truths, SCENE, n - 1)
    assert found.hindsight[0] == pytest.approx(whole[20], rel=1e-5, abs=1e-8)
    assert found.live[1] == pytest.approx(whole[-1], rel=1e-5, abs=1e-8)
    assert found.live[0] == pytest.approx(at_once(truths, SCENE, 20)[20], rel=1e-5, abs=1e-8)
    assert found.of_pose(0, 1)[1] == pytest.approx(found.live[0, 5, 5])


class Drawn:
    """Two robots at 50 Hz as a function of all that is drawn by chance, written down anew.

    The unknowns: where robot 1 began, scale and yaw rate of both, what each step of each wheel
    base is off, along and about, the bias of the pair and its slow bias in each step.
    """

    def __init__(self, truths: Array, scene: world.Scene) -> None:
        self.truths, self.scene, self.n = truths, scene, len(truths)
        self.size = 7 + 4 * (self.n - 1) + 1 + self.n

    def poses(self, drawn: Array) -> Array:
        """(n, 2, 3) where they would be, given what their wheels said."""
        out = np.empty_like(self.truths)
        noise = drawn[7 : 7 + 4 * (self.n - 1)].reshape(2, 2, -1)
        model = self.scene.odometry
        for robot in range(2):
            truth = self.truths[:, robot]
            way, turn = np.diff(truth, axis=0)[:, :2], np.diff(truth[:, 2])
            middle = truth[:-1, 2] + turn / 2
            said = way[:, 0] * np.cos(middle) + way[:, 1] * np.sin(middle)
            some = np.sqrt(np.abs(said))
            along, about = noise[robot] * some
            scale, bend = drawn[3 + 2 * robot : 5 + 2 * robot]
            driven = (said - along * model.translation_per_sqrt_m) / (1 + scale)
            turned = turn - bend * np.abs(driven) - about * np.radians(model.yaw_deg_per_sqrt_m)
            pose = truth[0] + (drawn[:3] if robot else 0.0)
            heading = np.append(pose[2], pose[2] + np.cumsum(turned))
            middle = heading[:-1] + turned / 2
            out[0, robot], out[:, robot, 2] = pose, heading
            for axis, part in enumerate((np.cos(middle), np.sin(middle))):
                out[1:, robot, axis] = pose[axis] + np.cumsum(driven * part)
        return out

    def ranges(self, drawn: Array) -> Array:
        """(n,) m."""
        poses = self.poses(drawn)
        apart = np.hypot(*(poses[:, 1] - poses[:, 0])[:, :2].T)
        return np.asarray(apart + drawn[-1 - self.n] + drawn[-self.n :])

    def prior(self) -> Array:
        """(size, size) covariance of what is drawn."""
        ranges, odometry = self.scene.ranges, self.scene.odometry
        out = np.eye(self.size)
        bend = np.radians(odometry.yaw_deg_per_m)
        start = [10.0, 10.0, 1.8, odometry.scale, bend, odometry.scale, bend]
        out[:7, :7] = np.diag(np.square(start))
        out[-1 - self.n, -1 - self.n] = ranges.bias**2
        t = np.arange(self.n) * world.STEP_S
        apart = np.abs(t[:, None] - t) / ranges.slow_s
        out[-self.n :, -self.n :] = ranges.slow**2 * np.exp(-apart)
        return out

    def known(self, steps: int, at: int) -> Array:
        """(6, 6) covariance of both poses at one time, after the ranges of so many steps."""

        def seen(drawn: Array) -> Array:
            return np.concatenate([self.ranges(drawn)[:steps], self.poses(drawn)[at].ravel()])

        tiny, columns = 1e-5, []
        for k in range(self.size):
            off = np.zeros(self.size)
            off[k] = tiny
            columns.append((seen(off) - seen(-off)) / (2 * tiny))
        j = np.stack(columns, axis=1)
        both = j @ self.prior() @ j.T
        heard = 2 * (1 - self.scene.ranges.lost) * (1 - self.scene.ranges.burst_share)
        noise = self.scene.ranges.white**2 / heard * np.eye(steps)
        across = both[steps:, :steps]
        known = across @ np.linalg.solve(both[:steps, :steps] + noise, across.T)
        return np.asarray(both[steps:, steps:] - known)


@pytest.mark.slow
def test_numerical_derivatives_of_a_model_at_fifty_hertz_give_the_same_bound() -> None:
    """Wheel noise is large enough here to matter beside the ranges within seconds."""
    wheels = world.OdometryModel(0.07, 0.5, 3.0, 0.05)
    scene = replace(SCENE, seconds=4.0, range_hz=50, odometry=wheels)
    rng = np.random.default_rng(4)
    truths = np.stack([world.drive(rng, scene) for _ in range(2)], axis=1)
    every = round(cramer_rao.STEP_S / world.STEP_S)
    found = cramer_rao.of_team(truths[::every], scene, np.array([20, 39]))
    drawn = Drawn(truths, scene)
    # the bound takes the ranges of a tenth of a second for those of its middle
    for bound, steps, k in (
        (found.hindsight[0], len(truths), 20),
        (found.live[0], 20 * every + 3, 20),
        (found.live[1], 39 * every + 3, 39),
    ):
        sigmas = np.sqrt(np.diag(drawn.known(steps, every * k)))
        assert np.sqrt(np.diag(bound)) == pytest.approx(sigmas, rel=0.05, abs=1e-4)


def test_errors_go_on_as_those_of_wheels_that_err() -> None:
    """A scale and a yaw rate, small enough to be linear; the same draws give both."""
    model = world.OdometryModel(1e-4, np.degrees(1e-4), 0.0, 0.0)
    truths = driven(replace(SCENE, seconds=20.0), seed=5)
    draws = np.random.default_rng(9).normal(0, [1e-4, 1e-4])
    said, right = (
        world.wrong(np.random.default_rng(9), truths[:, 0], each)[-1]
        for each in (model, world.OdometryModel(0.0, 0.0, 0.0, 0.0))
    )
    theta = truths[0, 0, 2]
    cos, sin = np.cos(theta), np.sin(theta)
    x, y, turned = right - said
    off = np.array([cos * x - sin * y, sin * x + cos * y])
    step = cramer_rao._Transition(model, world.RangeModel(), 2, 1)
    state = np.zeros(step.size)
    state[[step._scale, step._yaw]] = draws
    for before, after in pairwise(truths):
        state = step.step(before, after)[0] @ state
    assert np.hypot(*off) > 5e-4
    assert state[:2] == pytest.approx(off, abs=0.02 * float(np.hypot(*off)))
    assert state[2] == pytest.approx(turned, rel=1e-3)


def test_a_pair_is_bound_in_the_frame_of_the_first() -> None:
    """Turning the first by a little moves a second that is 3 m away by 3 times that."""
    covariance = np.zeros((1, 6, 6))
    covariance[0, 2, 2] = 0.01
    poses = np.array([[[1.0, 1.0, 0.5], [1.0, 4.0, 2.0]]])
    bound = cramer_rao.Bound(np.zeros(1), covariance, covariance, poses)
    (metres,), (radians,) = bound.of_pair(0, 1)
    assert (metres, radians) == pytest.approx((0.09, 0.01))


def test_more_ranges_and_two_modules_are_less_noise() -> None:
    one = replace(SCENE, both_measure=False)
    assert cramer_rao._white(one) == pytest.approx(2 * cramer_rao._white(SCENE))
    assert cramer_rao._white(replace(one, range_hz=50)) == pytest.approx(cramer_rao._white(one) / 5)
