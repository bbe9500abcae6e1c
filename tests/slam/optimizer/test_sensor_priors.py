"""What is believed of the sensors' constants, by numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drslamd.slam.optimizer.bias_prior import BiasPrior
from drslamd.slam.optimizer.sensor_priors import Calibration, Priors

PRIORS = Priors(
    bias=BiasPrior(sigma=0.3, spread=0.08, dof=3.0, team=0.02),
    scale=np.array([0.03, 0.3]),
    scale_tails=3.0,
    yaw=np.array([0.01, 0.02]),
    near_bias=0.05,
)


def test_priors_cost_the_sum_of_what_each_constant_is_off() -> None:
    """Scales by Cauchy with a third of what is configured, yaw rates by him with all of it, the
    near-range bias by Gauss."""
    known = Calibration(
        bias=np.array([0.13, 0.05]),
        scale=np.array([0.01, 0.3]),
        yaw=np.array([0.02, -0.02]),
        near_bias=np.array([0.1]),
        team_bias=np.array([0.05]),
        turn=np.array([0.01, -0.01]),
        antenna=np.array([[0.012, -0.016], [0.0, 0.0]]),
    )
    own = np.array([0.08, 0.0])
    of_scales = math.log(2) + math.log(10)
    of_yaws = math.log(5) + math.log(2)
    of_near_bias = 4
    # half widths of 0.01 and 0.02 m, and tails of 0.5
    of_mountings = 2 * (math.log(2) + 0.02**2) + 1.5 * math.log(2) + 0.04**2
    expected = PRIORS.bias.cost(own, 0.05) + of_scales + of_yaws + of_near_bias + of_mountings
    assert PRIORS.cost(known) == pytest.approx(expected)
    assert PRIORS.cost(Calibration.zero(2, 2)) == 0


@pytest.mark.parametrize("times", [-0.5, 0.0, 0.3, 5.0])
def test_the_pull_on_a_scale_is_half_the_derivative_of_its_cost(times: float) -> None:
    scale, h = times * PRIORS.scale / 3, 1e-7
    for robot, unit in enumerate(np.eye(2)):
        ends = [
            PRIORS.cost(replace(Calibration.zero(2, 2), scale=scale + step * unit))
            for step in (h, -h)
        ]
        assert PRIORS.scale_pull(scale)[robot] == pytest.approx(
            (ends[0] - ends[1]) / (4 * h), rel=1e-5, abs=1e-4
        )


def test_the_curvature_of_a_scale_is_the_derivative_of_its_pull_and_stays_positive() -> None:
    scale, h = 0.2 * PRIORS.scale, 1e-7
    true = (PRIORS.scale_pull(scale + h) - PRIORS.scale_pull(scale - h)) / (2 * h)
    assert PRIORS.scale_curvature(scale) == pytest.approx(true, rel=1e-5)
    assert (PRIORS.scale_curvature(10 * PRIORS.scale) > 0).all()


@pytest.mark.parametrize("times", [-0.5, 0.0, 0.3, 5.0])
def test_the_pull_on_a_yaw_rate_is_half_the_derivative_of_its_cost(times: float) -> None:
    yaw, h = times * PRIORS.yaw, 1e-7
    for robot, unit in enumerate(np.eye(2)):
        ends = [
            PRIORS.cost(replace(Calibration.zero(2, 2), yaw=yaw + step * unit)) for step in (h, -h)
        ]
        assert PRIORS.yaw_pull(yaw)[robot] == pytest.approx(
            (ends[0] - ends[1]) / (4 * h), rel=1e-5, abs=1e-4
        )


def test_near_nothing_a_yaw_rate_is_held_as_configured_and_far_off_hardly() -> None:
    nothing, far = np.zeros(2), 20 * PRIORS.yaw
    assert PRIORS.yaw_curvature(nothing) == pytest.approx(PRIORS.yaw**-2)
    assert PRIORS.yaw_claim(nothing) == pytest.approx(PRIORS.yaw**-2)
    assert PRIORS.yaw_claim(far) == pytest.approx((PRIORS.yaw**2 + far**2) ** -1)
    assert (PRIORS.yaw_curvature(far) > 0).all()
    true = (PRIORS.yaw_pull(nothing + 1e-9) - PRIORS.yaw_pull(nothing - 1e-9)) / 2e-9
    assert PRIORS.yaw_curvature(nothing) == pytest.approx(true, rel=1e-5)


def test_what_was_learned_adds_up() -> None:
    names = ("bias", "scale", "yaw", "near_bias", "team_bias", "turn", "antenna")
    zero = Calibration.zero(3, 2)
    shapes = [(3,), (2,), (2,), (1,), (1,), (2,), (2, 2)]
    assert [getattr(zero, name).shape for name in names] == shapes
    assert not any(getattr(zero, name).any() for name in names)
    values = {name: np.array([k + 1.0]) for k, name in enumerate(names[:-1])}
    step = replace(Calibration.zero(1, 1), **values, antenna=np.array([[7.0, 8.0]]))
    twice = Calibration.zero(1, 1).plus(step).plus(step)
    assert [getattr(twice, name)[0] for name in names[:-1]] == [2, 4, 6, 8, 10, 12]
    assert twice.antenna.tolist() == [[14, 16]]
