"""The pose graphs of the benchmark: files, certified optima, and their split over robots."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from drslamd.slam.optimizer.complex_factors import ComplexFactors
from lab.recordings import g2o
from lab.recordings.recording import Array

FOLDER = Path(
    os.environ.get(
        "DRSLAMD_POSEGRAPHS",
        Path(__file__).resolve().parents[4] / "shared" / "data" / "posegraphs",
    )
)
"""Where the .g2o files are."""


@dataclass(frozen=True)
class Known:
    """What is known of one graph.

    Attributes:
        robots: that it is split over, by the order of its poses.
        optimum: of DPGO's cost, certified by SE-Sync (suboptimality below 1e-8).
        same_time: pose k of every robot is of one time.
    """

    file: str
    robots: int
    optimum: float
    same_time: bool = False


GRAPHS = {
    "team3_400": Known("team3_400.g2o", 3, 1992.71324672, True),
    "team5_400": Known("team5_400.g2o", 5, 2471.59492642, True),
    "team8_400": Known("team8_400.g2o", 8, 2968.78742873, True),
    "team3_2000": Known("team3_2000.g2o", 3, 5098.44880113, True),
    "CSAIL": Known("CSAIL.g2o", 5, 31.4703316653),
    "MITb": Known("input_MITb_g2o.g2o", 5, 61.1541155245),
    "INTEL": Known("input_INTEL_g2o.g2o", 5, 393.652540982),
    "M3500": Known("input_M3500_g2o.g2o", 5, 193.862258511),
}


@dataclass(frozen=True)
class Graph:
    """One graph, split.

    Attributes:
        robot, n: (k,) whose pose each one is, and its number on that robot.
        i, j: (m,) ends of the edges.
        tau, kappa: (m,) DPGO's weights: of positions 2 / trace of their covariance (read from the
            information of x and y alone), of angles the information of the angle, which counts
            twice because DPGO takes the Frobenius norm of a difference of rotations.
    """

    name: str
    known: Known
    read: g2o.G2o
    robot: Array
    n: Array
    tau: Array
    kappa: Array

    @property
    def count(self) -> int:
        return len(self.robot)

    def gap(self, cost: float) -> float:
        """Relative distance to the certified optimum."""
        return cost / self.known.optimum - 1

    @cached_property
    def place(self) -> Array:
        """(k,) of each pose in the order of time, or of the file where times are not the same."""
        order = np.lexsort((self.robot, self.n)) if self.known.same_time else np.arange(self.count)
        place = np.empty(self.count, dtype=np.int64)
        place[order] = np.arange(self.count)
        return place

    @cached_property
    def edges(self) -> ComplexFactors:
        """Between poses by their places."""
        i, j = self.place[self.read.i], self.place[self.read.j]
        x, y, theta = self.read.measured.T
        return ComplexFactors(i, j, np.exp(1j * theta), x + 1j * y, self.kappa, self.tau)


def load(name: str, robots: int | None = None, folder: Path | None = None) -> Graph:
    """Read one graph.

    Raises:
        OSError: it is not there.
        BadRecording: it is no pose graph.
    """
    known = GRAPHS[name]
    read = g2o.read((folder or FOLDER) / known.file)
    count, robots = len(read.ids), robots or known.robots
    each = count // robots
    robot = np.minimum(np.arange(count) // each, robots - 1)
    n = np.arange(count) - robot * each
    tau = 2 / np.trace(np.linalg.inv(read.information[:, :2, :2]), axis1=1, axis2=2)
    return Graph(name, known, read, robot, n, tau, kappa=2 * read.information[:, 2, 2])
