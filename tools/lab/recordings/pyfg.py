"""Reader and writer of ``.pyfg``, the text format of range-aided pose graphs (PyFactorGraph).

Lines (SE(2) only): ``VERTEX_SE2 t key x y yaw`` (truth), ``VERTEX_XY key x y`` (standing node),
``EDGE_SE2 t from to dx dy dyaw`` and six covariances, ``EDGE_RANGE t a b range variance``. A key
is a letter for the robot and a number; robots become ids in the order of their letters, standing
nodes follow them. A range belongs to the module of the robot named first, at its own stamp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lab.recordings.recording import Array, BadRecording, Recording, Trail

LEAST_STEP_S = 1e-4
"""Equal stamps of neighbouring poses are moved apart by this."""

FIELDS = {"VERTEX_SE2": (6,), "VERTEX_XY": (4, 5), "EDGE_SE2": (13,), "EDGE_RANGE": (6,)}
"""How many words a line of each kind has; other kinds are left alone."""


@dataclass(frozen=True)
class _Edge:
    """One step of the odometry."""

    t: float
    start: str
    end: str
    step: list[float]


@dataclass
class _File:
    """What stands in a file. A key of a pose begins with the letter of its robot."""

    truth: dict[str, tuple[float, list[float]]] = field(default_factory=dict)
    edges: dict[str, list[_Edge]] = field(default_factory=dict)
    ranges: list[tuple[float, str, str, float]] = field(default_factory=list)
    nodes: set[str] = field(default_factory=set)

    def take(self, words: list[str]) -> None:
        """
        Raises:
            ValueError: this line cannot be used.
        """
        kind, counts = words[0], FIELDS.get(words[0])
        if counts is None:
            return
        if len(words) not in counts:
            raise ValueError(f"{kind} has {len(words)} words, not {counts[-1]}")
        if kind == "VERTEX_XY":
            self.nodes.add(words[-3][0])
            return
        t = _number(words[1])
        if kind == "VERTEX_SE2":
            self.truth[words[2]] = t, [_number(w) for w in words[3:6]]
        elif kind == "EDGE_SE2":
            self._take_edge(_Edge(t, words[2], words[3], [_number(w) for w in words[4:7]]))
        else:
            self.ranges.append((t, words[2][0], words[3][0], _number(words[4])))

    def _take_edge(self, edge: _Edge) -> None:
        chain = self.edges.setdefault(edge.start[0], [])
        if edge.end[0] != edge.start[0] or (chain and chain[-1].end != edge.start):
            raise ValueError(f"EDGE_SE2 {edge.start} {edge.end} does not continue the odometry")
        chain.append(edge)


def _number(word: str) -> float:
    value = float(word)
    if not math.isfinite(value):
        raise ValueError(f"{word} is no number to work with")
    return value


def read(path: Path) -> Recording:
    """Read one file.

    Raises:
        BadRecording: not a pyfg file, or one without odometry.
    """
    file = _File()
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        try:
            if line.strip():
                file.take(line.split())
        except ValueError as error:
            raise BadRecording(f"{path.name} line {number}: {error}") from None
    if not file.edges:
        raise BadRecording(f"{path.name}: no EDGE_SE2 line, so no odometry to play")
    every = [e for edges in file.edges.values() for e in edges]
    missing = [key for e in every for key in (e.start, e.end) if key not in file.truth]
    if missing:
        raise BadRecording(f"{path.name}: no VERTEX_SE2 {missing[0]}, so nothing to score against")
    standing = file.nodes | {letter for _, *ends, _ in file.ranges for letter in ends}
    letters = [*sorted(file.edges), *sorted(standing - set(file.edges))]
    ids = {letter: k for k, letter in enumerate(letters)}
    start = min([_began(e, file) for e in file.edges.values()] + [r[0] for r in file.ranges]) - 0.1
    trails = {
        ids[letter]: _trail(ids[letter], edges, file, start)
        for letter, edges in sorted(file.edges.items())
    }
    table = np.array([(t - start, ids[a], ids[b], r) for t, a, b, r in file.ranges], dtype=float)
    table = table.reshape(-1, 4)
    return Recording(path.name, trails, table[np.argsort(table[:, 0], kind="stable")])


def _began(edges: list[_Edge], file: _File) -> float:
    """When the first pose of a robot was: only its vertex knows, by another clock it may be."""
    return min(file.truth[edges[0].start][0], edges[0].t - LEAST_STEP_S)


def _trail(robot: int, edges: list[_Edge], file: _File, start: float) -> Trail:
    """Chain the edges of one robot; the stamp of an edge is that of the pose it leads to."""
    pose = np.zeros(3)
    poses, times = [pose], [_began(edges, file) - start]
    for edge in edges:
        dx, dy, dyaw = edge.step
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        pose = pose + [cos * dx - sin * dy, sin * dx + cos * dy, dyaw]
        poses.append(pose)
        times.append(max(edge.t - start, times[-1] + LEAST_STEP_S))
    truth = [file.truth[key][1] for key in (edges[0].start, *(e.end for e in edges))]
    return Trail(robot, np.array(times), np.array(poses), np.array(truth))


def write(path: Path, recording: Recording, range_sigma: float, odometry_sigmas: Array) -> None:
    """Write a recording so that `read` gives it back.

    Args:
        range_sigma: m, stated in the file.
        odometry_sigmas: (3,) of one edge, stated in the file.
    """
    lines, edges = [], []
    xx, yy, tt = (f"{s * s:.9g}" for s in odometry_sigmas)
    for robot, trail in sorted(recording.trails.items()):
        letter = chr(ord("A") + robot)
        for k, (t, (x, y, yaw)) in enumerate(zip(trail.t, trail.truth, strict=True)):
            lines.append(f"VERTEX_SE2 {t:.6f} {letter}{k} {x:.9g} {y:.9g} {yaw:.9g}")
        step = np.diff(trail.odometry, axis=0)
        cos, sin = np.cos(trail.odometry[:-1, 2]), np.sin(trail.odometry[:-1, 2])
        dx = cos * step[:, 0] + sin * step[:, 1]
        dy = -sin * step[:, 0] + cos * step[:, 1]
        edges += [
            f"EDGE_SE2 {t:.6f} {letter}{k} {letter}{k + 1} {a:.9g} {b:.9g} {c:.9g} "
            f"{xx} 0.0 0.0 {yy} 0.0 {tt}"
            for k, (t, a, b, c) in enumerate(zip(trail.t[1:], dx, dy, step[:, 2], strict=True))
        ]
    for t, a, b, r in recording.ranges:
        keys = []
        for robot in (int(a), int(b)):
            at = int(np.argmin(np.abs(recording.trails[robot].t - t)))
            keys.append(f"{chr(ord('A') + robot)}{at}")
        edges.append(f"EDGE_RANGE {t:.6f} {keys[0]} {keys[1]} {r:.6f} {range_sigma**2:.9g}")
    path.write_text("\n".join(lines + edges) + "\n")
