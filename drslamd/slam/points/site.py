"""The frame of a site: where modules stand whose coordinates somebody has measured.

Two of them make a frame. The team solves everything in a frame of its own; the site's is laid over
the places that it found, with the covariance of all of them together, so it says how well it is
known. A module that was moved does not fit the others any more: of three or more the one is left
out without which the others fit, of two nobody can tell which, and then there is no frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drslamd.conventions import FIRST_NODE
from drslamd.slam import se2
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate
from drslamd.slam.se2 import Array

SURVEYED_M = 0.03
"""How well coordinates are measured."""
TOO_FAR = 5.0
"""Chi-squared per degree of freedom beyond which modules do not stand where they are said to."""
LEAST_APART_M = 1.0
"""Two that are nearer make no frame."""
STEPS = 4
EARTH_M = 6_378_137.0
"""Half of the long axis of WGS 84."""
FLATTENING = 1 / 298.257223563


@dataclass(frozen=True)
class Survey:
    """
    Attributes:
        places: (2,) m by UWB id.
        origin: latitude and longitude, degrees, of the point (0, 0), where x is east and y north;
            None where nobody knows them.
    """

    places: Mapping[int, Array]
    origin: tuple[float, float] | None = None

    @staticmethod
    def of_degrees(places: Mapping[int, tuple[float, float]]) -> Survey:
        """By latitude and longitude; the first module is the origin."""
        origin = next(iter(places.values()))
        east, north = metres_per_degree(origin[0])
        return Survey(
            {
                uwb_id: np.array([(lon - origin[1]) * east, (lat - origin[0]) * north])
                for uwb_id, (lat, lon) in places.items()
            },
            origin,
        )

    def degrees(self, place: Array) -> tuple[float, float]:
        """Latitude and longitude of a place (2,) of the site."""
        assert self.origin is not None
        east, north = metres_per_degree(self.origin[0])
        return self.origin[0] + float(place[1]) / north, self.origin[1] + float(place[0]) / east


def metres_per_degree(latitude: float) -> tuple[float, float]:
    """Of longitude and of latitude, on the ellipsoid."""
    lat = np.radians(latitude)
    e2 = FLATTENING * (2 - FLATTENING)
    w = 1 - e2 * np.sin(lat) ** 2
    east = EARTH_M * np.cos(lat) / np.sqrt(w)
    north = EARTH_M * (1 - e2) / w**1.5
    return float(np.radians(1) * east), float(np.radians(1) * north)


class Site(NamedTuple):
    """
    Attributes:
        site_T_w: (3,), covariance: (3, 3) of a twist of it about the middle of its modules.
        middle: (2,) of these, in w.
        used: their UWB ids; left_out: of those that do not fit.
        off_m: root mean square of what is left between both.
    """

    site_T_w: Array
    covariance: Array
    middle: Array
    used: tuple[int, ...]
    left_out: tuple[int, ...]
    off_m: float

    def pose(self, found: PoseNow) -> tuple[Array, Array]:
        """A pose (3,) of the team in the site's frame, and its covariance (3, 3) there."""
        pose = se2.compose(self.site_T_w, found.pose)
        arm = se2.rotate(self.site_T_w[2], found.pose[:2] - self.middle)
        lever = np.eye(3)
        lever[:2, 2] = -arm[1], arm[0]
        spread = se2.turned(found.covariance, self.site_T_w[2])
        pose[2] = se2.wrap(pose[2])
        return pose, np.asarray(spread + lever @ self.covariance @ lever.T)


def site_of(estimate: TeamEstimate | None, survey: Survey) -> Site | str:
    """The site's frame, or why there is none."""
    if estimate is None:
        return "no module of the site is known yet"
    known = tuple(
        uwb_id
        for uwb_id in survey.places
        if FIRST_NODE + uwb_id in estimate.nodes
        and estimate.covariance(FIRST_NODE + uwb_id) is not None
    )
    if len(known) < 2:
        return f"{len(known)} of its modules known, and two make a frame"
    found = _laid(estimate, survey, known, ())
    if isinstance(found, str) or found[1] <= TOO_FAR:
        return found if isinstance(found, str) else found[0]
    if len(known) > 2:
        without = [
            _laid(estimate, survey, tuple(k for k in known if k != out), (out,)) for out in known
        ]
        fitting = [one for one in without if not isinstance(one, str) and one[1] <= TOO_FAR]
        if fitting:
            return min(fitting, key=lambda one: one[1])[0]
    listed = ", ".join(map(str, known))
    return f"modules {listed} do not stand as far from each other as the coordinates say"


def _laid(
    estimate: TeamEstimate, survey: Survey, used: tuple[int, ...], left_out: tuple[int, ...]
) -> tuple[Site, float] | str:
    """Laid over these modules, and chi-squared per degree of freedom."""
    numbers = [FIRST_NODE + uwb_id for uwb_id in used]
    found = np.array([estimate.nodes[number].poses[-1, :2] for number in numbers])
    there = np.array([survey.places[uwb_id] for uwb_id in used])
    if np.hypot(*(there - there[0]).T).max() < LEAST_APART_M:
        return "its modules stand in one place, and two apart make a frame"
    middle = found.mean(axis=0)
    arm, wanted = found - middle, there - there.mean(axis=0)
    cross = (wanted @ [1, 1j]) * np.conj(arm @ [1, 1j])
    theta, place = float(np.angle(cross.sum())), there.mean(axis=0)
    at = np.concatenate([estimate.rows_of(number)[:2] for number in numbers])
    spread = estimate.joint[np.ix_(at, at)]
    for _ in range(STEPS):
        turned = se2.rotate(theta, arm)
        turn = np.kron(np.eye(len(used)), se2.rotate(theta, np.eye(2)).T)
        noise = turn @ spread @ turn.T + SURVEYED_M**2 * np.eye(2 * len(used))
        jacobian = np.zeros((len(used), 2, 3))
        jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1.0
        jacobian[:, 0, 2], jacobian[:, 1, 2] = -turned[:, 1], turned[:, 0]
        j = jacobian.reshape(-1, 3)
        off = (there - place - turned).ravel()
        weighted = np.linalg.solve(noise, np.column_stack([j, off]))
        covariance = np.linalg.inv(j.T @ weighted[:, :3])
        step = covariance @ (j.T @ weighted[:, 3])
        place, theta = place + step[:2], theta + float(step[2])
    rest = (there - place - se2.rotate(theta, arm)).ravel()
    chi2 = float(rest @ np.linalg.solve(noise, rest)) / (2 * len(used) - 3)
    site_T_w = np.append(place - se2.rotate(theta, middle), se2.wrap(theta))
    rms = float(np.sqrt(np.mean(rest**2) * 2))
    return Site(site_T_w, covariance, middle, used, left_out, rms), chi2
