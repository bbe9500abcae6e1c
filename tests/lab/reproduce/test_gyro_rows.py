"""The rows of tools/reproduce --gyro: what is done to a robot, and when a row is reached."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.reproduce.gyro import gyro_rows
from lab.reproduce.gyro.gyro_rows import CASES, FROM_S, Case, row, slipping
from lab.reproduce.tally import Tally

BY_NAME = {case.name: case for case in CASES}


def tally(factor: float = 1.0, named: tuple[float, ...] = (), seeds: int = 2) -> Tally:
    """With `factor` times what is wanted of a gyro."""
    out = Tally()
    for name, most in gyro_rows.MOST.items():
        out.add(name, factor * most)
    out.add("drslamd/published/nees", 1.0)
    out.add("asked", [1.0] * seeds)
    out.add("named_s", named)
    return out


def test_a_wheel_slips_by_a_fifth_for_ten_seconds() -> None:
    t = np.arange(100.0, 141.0)
    left, right = slipping(t, t, t)
    assert left is t
    assert right[-1] - right[0] == pytest.approx(40 + 0.2 * 10)
    assert np.diff(right)[[0, 18, 19, 28, 29]] == pytest.approx([1, 1, 1.2, 1.2, 1])


def test_gyros_go_wrong_when_they_should() -> None:
    said = {}
    for name in ("unplugged", "stuck", "biased by 1 deg/s", "upside down"):
        wrong = BY_NAME[name].wrong
        assert wrong is not None
        says = wrong()
        said[name] = [says(t, 0.5 + t) for t in (FROM_S - 1, FROM_S, FROM_S + 2)]
    before, at, after = 119.5, 120.5, 122.5
    assert said == {
        "unplugged": [before, None, None],
        "stuck": [before, at, at],
        "biased by 1 deg/s": [before, at, after + math.radians(2)],
        "upside down": [-before, -at, -after],
    }


@pytest.mark.parametrize(("factor", "is_reached"), [(0.99, True), (1.01, False)])
def test_a_gyro_is_reached_by_its_figures(factor: float, is_reached: bool) -> None:
    line, reached = row(BY_NAME["gyro"], {"gyro": tally(factor)})
    assert reached is is_reached
    assert line.startswith("| gyro | 0.036 |")


@pytest.mark.parametrize(
    ("factor", "named", "is_reached"),
    [
        (0.99, (1.0, 9.9), True),
        (1.01, (1.0, 9.9), False),
        (0.99, (1.0, 10.1), False),
        (0.99, (1.0,), False),
    ],
)
def test_a_wrong_gyro_is_reached_when_it_is_named_and_costs_nothing(
    factor: float, named: tuple[float, ...], is_reached: bool
) -> None:
    totals = {"none": tally(), "stuck": tally(factor, named)}
    assert row(BY_NAME["stuck"], totals)[1] is is_reached


def test_a_slip_may_cost_a_fifth_more_and_nothing_is_asked_of_it_without_a_gyro() -> None:
    slip = BY_NAME["a wheel slips"]
    for factor, is_reached in ((1.19, True), (1.21, False)):
        totals = {"gyro": tally(), slip.name: tally(factor, (1.0, 2.0))}
        assert row(slip, totals)[1] is is_reached
    assert row(Case("x", has_gyro=False, slips=True), {"x": tally(9.0)})[1]
