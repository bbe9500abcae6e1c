"""A segment of odometry is placed by ranges to peers whose places are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drslamd.slam import se2
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relocation import placing
from drslamd.slam.relocation.placing import (
    FEWEST,
    LEAST,
    Placed,
    Prior,
    WayUnder,
    place,
    scatter_about,
)
from drslamd.slam.relocation.sightings import Sightings
from drslamd.slam.se2 import Array

NOISE = OdometryNoise(0.02, 0.002, 0.01, 0.008)
W_T_O = np.array([4.0, -1.0, 2.2])


def driven(
    way_m: float, off_m: float = 0.0, every: int = 4, count: int = 20
) -> tuple[Sightings, WayUnder]:
    """A quarter of a circle as long as that, under ranges to two peers that stand; one range
    in so many is off."""
    along = np.linspace(0, 1, count)
    radius = max(way_m, 1e-3) / (np.pi / 2)
    q = radius * np.stack([np.sin(along * np.pi / 2), 1 - np.cos(along * np.pi / 2)], axis=-1)
    turn = np.array([[np.cos(2.2), -np.sin(2.2)], [np.sin(2.2), np.cos(2.2)]])
    true = W_T_O[:2] + q @ turn.T
    beacons = np.array([[0.0, 0.0], [6.0, 5.0]])[np.arange(count) % 2]
    metres = np.hypot(*(true - beacons).T)
    metres[::every] += off_m
    seconds = along * way_m / 0.5
    seen = Sightings(
        seconds * 1e6,
        beacons,
        metres,
        np.full(count, 0.05),
        np.full(count, 0.05),
        np.arange(count) % 2,
    )
    return seen, WayUnder(q, q[0], along * way_m, NOISE)


def prior(sigma_m: float = 0.3, off_m: float = 0.0) -> Prior:
    return Prior(W_T_O[:2] + [off_m, 0.0], sigma_m**2 * np.eye(2), 5.0)


def test_three_metres_of_a_curve_have_one_place() -> None:
    found = place(*driven(3.0), prior(), LINKTRACK)
    assert isinstance(found, Placed)
    assert found.w_T_o == pytest.approx(W_T_O, abs=0.05)
    assert found.covariance[2, 2] < np.radians(8.0) ** 2


@pytest.mark.parametrize(("every", "is_named"), [(4, True), (3, False)])
def test_a_quarter_of_the_ranges_may_be_off(every: int, is_named: bool) -> None:
    found = place(*driven(3.0, 2.5, every), prior(), LINKTRACK)
    if is_named:
        assert isinstance(found, Placed)
        assert found.w_T_o == pytest.approx(W_T_O, abs=0.05)
    else:
        assert found == "ranges and odometry disagree"


def test_who_has_hardly_moved_has_no_heading() -> None:
    assert place(*driven(0.05), prior(), LINKTRACK) == "not enough motion"


@pytest.mark.parametrize(
    ("sigma_m", "degrees", "is_named"),
    [(0.34, 7.9, True), (0.36, 7.9, False), (0.34, 8.1, False)],
)
def test_a_place_is_known_to_35_centimetres_and_eight_degrees_or_not_named(
    sigma_m: float, degrees: float, is_named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged = placing._Problem.judged
    spread = np.diag([0.1, sigma_m, np.radians(degrees)]) ** 2

    def with_spread(problem: placing._Problem, x: Array) -> placing._Judged:
        return judged(problem, x)._replace(covariance=spread)

    monkeypatch.setattr(placing._Problem, "judged", with_spread)
    found = place(*driven(3.0), prior(), LINKTRACK)
    assert isinstance(found, Placed) if is_named else found == "not enough motion"


def test_two_places_that_fit_are_ambiguous() -> None:
    """On a straight line, and of where it was nothing is known: the other side of the line between
    both peers fits as well."""
    assert place(*on_a_line(), LINKTRACK) == "ambiguous"


def on_a_line() -> tuple[Sightings, WayUnder, Prior]:
    seen, stretch = driven(3.0)
    straight = np.stack([stretch.way_m, 0 * stretch.way_m], axis=-1)
    turn = np.array([np.cos(2.2), np.sin(2.2)])
    true = W_T_O[:2] + stretch.way_m[:, None] * turn
    seen = replace(seen, range_m=np.hypot(*(true - seen.place).T))
    wide = Prior(np.array([3.0, 2.5]), 25.0 * np.eye(2), 6.0)
    return seen, replace(stretch, antenna=straight), wide


@pytest.mark.parametrize(
    ("by_ranges", "by_prior", "is_named"),
    [
        (11.9, 0.0, False),
        (12.1, 0.0, True),
        (11.9, 8.0, False),
        (11.9, 8.2, True),
        (12.1, -0.2, False),
        (2.9, 17.2, False),
        (3.1, 17.0, True),
        (3.1, 16.8, False),
    ],
)
def test_a_place_that_ranges_make_four_hundred_times_less_likely_is_none(
    by_ranges: float, by_prior: float, is_named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or a hundred times less than that, where the place before the hole has a say in it, but for
    what ranges must say themselves."""
    judged = placing._Problem.judged
    first: list[float] = []

    def with_costs(problem: placing._Problem, x: Array) -> placing._Judged:
        found = judged(problem, x)
        first.append(found.x[2])
        is_same = abs(se2.wrap(found.x[2] - first[0])) < 0.1
        worse = 0.0 if is_same else by_ranges + by_prior
        return found._replace(chi2=5.0 + worse, before=0.0 if is_same else by_prior)

    monkeypatch.setattr(placing._Problem, "judged", with_costs)
    assert isinstance(place(*on_a_line(), LINKTRACK), Placed) is is_named


@pytest.mark.parametrize(
    ("chi2", "ranges", "scatter"),
    [
        (3.0, 51, LEAST),
        (17.0, 51, LEAST),
        (18.0, 51, 0.5**0.5),
        (48.0, 51, 1.0),
        (200.0, 51, 1.0),
        (1.0, 10, (13 / 19) ** 0.5),
    ],
)
def test_ranges_that_fit_better_than_was_thought_scatter_less_and_never_more(
    chi2: float, ranges: int, scatter: float
) -> None:
    """Of n ranges three unknowns are determined; twelve were known before."""
    assert scatter_about(chi2, ranges) == pytest.approx(scatter)


def test_a_claim_is_as_narrow_as_ranges_fit() -> None:
    """Ranges without noise, and the same with what was allowed for; not of the bias, which they do
    not tell."""
    seen, stretch = driven(3.0)
    noise = np.random.default_rng(1).normal(size=20) * 0.05
    exact = place(seen, stretch, prior(), LINKTRACK)
    noisy = place(replace(seen, range_m=seen.range_m + noise), stretch, prior(), LINKTRACK)
    assert isinstance(exact, Placed)
    assert isinstance(noisy, Placed)
    assert 0.7 < np.sqrt(exact.covariance[2, 2] / noisy.covariance[2, 2]) < 0.95


@pytest.mark.parametrize("count", [FEWEST - 1, FEWEST])
def test_few_ranges_name_no_place(count: int) -> None:
    found = place(*driven(3.0, count=count), prior(), LINKTRACK)
    assert isinstance(found, Placed) is (count == FEWEST)


def test_a_place_before_the_hole_that_is_wrong_never_makes_a_wrong_one_sure() -> None:
    """It was believed to be on the other side of the line between both peers."""
    mirrored = Prior(np.array([1.0, 4.0]), 0.01 * np.eye(2), 7.0)
    found = place(*driven(3.0), mirrored, LINKTRACK)
    assert isinstance(found, str) or found.w_T_o == pytest.approx(W_T_O, abs=0.1)
