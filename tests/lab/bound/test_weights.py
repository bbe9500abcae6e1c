"""What weighing each range by itself costs, against all measurements weighed at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lab.bound import cramer_rao, weights
from lab.recordings import world
from lab.recordings.recording import Array

SCENE = world.Scene(robots=2, seconds=6.0, range_hz=10)
SIGMA_M = 0.1


def driven(seed: int = 3) -> Array:
    """(n, R, 3) true poses, one each step of the bound."""
    rng = np.random.default_rng(seed)
    every = round(cramer_rao.STEP_S / world.STEP_S)
    return np.stack([world.drive(rng, SCENE)[::every] for _ in range(SCENE.robots)], axis=1)


def prior_of(truths: Array, scene: world.Scene) -> Array:
    """(n size, n size) covariance of the states of all steps, before anything is measured."""
    step = cramer_rao._Transition(scene.odometry, scene.ranges, 2, 1)
    n, size = len(truths), step.size
    reach = np.zeros((n, size, n * size))
    noise = np.zeros((n * size, n * size))
    noise[:size, :size] = cramer_rao._start(scene.odometry, scene.ranges, 2, 1)
    reach[0, :, :size] = np.eye(size)
    for k in range(1, n):
        here = slice(k * size, (k + 1) * size)
        f, noise[here, here] = step.step(truths[k - 1], truths[k])
        reach[k] = f @ reach[k - 1]
        reach[k, :, here] = np.eye(size)
    whole = reach.reshape(n * size, n * size)
    return np.asarray(whole @ noise @ whole.T)


def test_it_errs_as_weights_do_that_are_found_without_slow_errors() -> None:
    truths = driven()
    n, size = len(truths), 6 + 2 + 4
    sight = cramer_rao._sights(truths, [(0, 1)], size)
    h = np.zeros((n, n * size))
    for k in range(n):
        h[k, k * size : (k + 1) * size] = sight[k, 0]
    believed = prior_of(truths, replace(SCENE, ranges=replace(SCENE.ranges, slow=1e-9)))
    each = SIGMA_M**2 / cramer_rao.STEP_S * np.eye(n)
    gain = np.linalg.solve(h @ believed @ h.T + each, h @ believed).T
    left = np.eye(n * size) - gain @ h
    true = left @ prior_of(truths, SCENE) @ left.T + cramer_rao._white(SCENE) * gain @ gain.T
    last = true[-size:, -size:][:6, :6]
    found = cramer_rao.each_alone(truths, SCENE, SIGMA_M, np.array([n - 1]))
    assert found[0] == pytest.approx(last, rel=1e-5, abs=1e-8)


def test_nothing_is_lost_where_errors_do_not_last() -> None:
    truths, at = driven(), np.array([20, 50])
    scene = replace(SCENE, ranges=replace(SCENE.ranges, slow=1e-9, white=0.2))
    sigma = np.sqrt(cramer_rao._white(scene) * cramer_rao.STEP_S)
    found = cramer_rao.each_alone(truths, scene, sigma, at)
    assert found == pytest.approx(cramer_rao.of_team(truths, scene, at).live, rel=1e-5, abs=1e-8)


def test_where_they_last_no_weight_reaches_the_bound() -> None:
    truths, at = driven(), np.array([55])
    best = weights.variances(2, cramer_rao.of_team(truths, SCENE, at).live)
    for sigma in (0.02, 0.05, 0.1, 0.2):
        found = weights.variances(2, cramer_rao.each_alone(truths, SCENE, sigma, at))
        assert found[0] > 1.01 * best[0]


def test_variances_are_those_of_positions_of_all_but_robot_0() -> None:
    assert weights.variances(3, np.diag(np.arange(9.0))[None]).tolist() == [(3 + 4 + 6 + 7) / 2]


def test_the_command_prints_a_line_each_ten_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    assert weights.main(["--seeds", "1", "--robots", "2", "--seconds", "30"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split("|")[1].strip() for line in lines[2:]] == ["20", "30", "all"]
    bound, *cells = (float(cell) for cell in lines[2].split("|")[2:-1])
    errors, shares = cells[::2], cells[1::2]
    assert all(error > bound for error in errors)
    for error, share in zip(errors, shares, strict=True):
        assert share == pytest.approx((bound / error) ** 2, abs=0.02)
