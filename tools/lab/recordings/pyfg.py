"""Reader and writer of ``.pyfg``, the text format of range-aided pose graphs (PyFactorGraph).

Lines (SE(2) only): ``VERTEX_SE2 t key x y yaw`` (truth), ``VERTEX_XY key x y`` (standing node),
``EDGE_SE2 t from to dx dy dyaw`` and six covariances, ``EDGE_RANGE t a b range variance``. Robots
(`pose_keys.robot_of`) become ids in the order of their names, standing nodes follow them. An edge
between neighbouring poses of one robot is its odometry, in whatever order they stand; others are
loop closures, which nobody can play to a team: they are counted and left out. A range belongs to
the module of the robot named first, at its own stamp; where ranges have none, or all the same one,
at that of the pose.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lab.recordings import text_lines
from lab.recordings.pose_keys import order_of, robot_of
from lab.recordings.recording import Array, BadRecording, Recording, Trail
from lab.score import metrics

LEAST_STEP_S = 1e-4
"""Equal stamps of neighbouring poses are moved apart by this."""
STEP = "dx dy dyaw and six covariances"
RANGE = "t a b range variance belong there, or these without t"
KINDS = "VERTEX_SE2, VERTEX_XY, EDGE_SE2 and EDGE_RANGE are read"
THREE_D = "SE3"


@dataclass(frozen=True)
class _Edge:
    """A relative pose; `t` is when its end was."""

    t: float
    start: str
    end: str
    step: list[float]


@dataclass(frozen=True)
class _Range:
    """A distance; `t` is None where the file does not say when."""

    t: float | None
    a: str
    b: str
    metres: float


@dataclass
class _File:
    """What stands in a file."""

    truth: dict[str, tuple[float, list[float]]] = field(default_factory=dict)
    edges: dict[tuple[str, str], _Edge] = field(default_factory=dict)
    """The first of each two poses; a second one of them is no odometry."""
    more_edges: int = 0
    ranges: list[_Range] = field(default_factory=list)
    nodes: dict[str, list[float]] = field(default_factory=dict)

    def take(self, words: list[str]) -> None:
        """
        Raises:
            ValueError: this line cannot be used.
        """
        kind, rest = words[0], words[1:]
        if THREE_D in kind:
            raise ValueError(f"{kind} is a line of a graph in three dimensions; {KINDS}")
        if kind == "VERTEX_XY":
            if len(rest) not in (3, 4):
                raise ValueError(f"{kind} has {len(rest)} fields; key x y belong there")
            self.nodes[rest[-3]] = text_lines.numbers(rest[-2:], "x y")
        elif kind == "VERTEX_SE2":
            _long_enough(kind, rest, 5, "t key x y yaw")
            self.truth[rest[1]] = (
                text_lines.number(rest[0]),
                text_lines.numbers(rest[2:], "x y yaw"),
            )
        elif kind == "EDGE_SE2":
            _long_enough(kind, rest, 12, f"t from to {STEP}")
            t, step = text_lines.number(rest[0]), [text_lines.number(w) for w in rest[3:6]]
            self._take_edge(_Edge(t, rest[1], rest[2], step))
        elif kind == "EDGE_RANGE":
            self.ranges.append(_range(rest))

    def _take_edge(self, edge: _Edge) -> None:
        both = edge.start, edge.end
        if edge.start == edge.end:
            raise ValueError(f"EDGE_SE2 joins {edge.start} to itself")
        if both in self.edges:
            self.more_edges += 1
        else:
            self.edges[both] = edge

    def owner(self, key: str) -> str:
        """The robot whose pose a key names, or the standing node that it is."""
        return key if key in self.nodes and key not in self.truth else robot_of(key)

    def chains(self) -> dict[str, list[str]]:
        """The keys of each robot that has odometry, in their order."""
        keys: dict[str, set[str]] = {}
        for both in self.edges:
            if robot_of(both[0]) == robot_of(both[1]):
                keys.setdefault(robot_of(both[0]), set()).update(both)
        return {robot: sorted(found, key=order_of) for robot, found in sorted(keys.items())}


def _range(rest: list[str]) -> _Range:
    """With or without a time before it.

    Raises:
        ValueError: neither.
    """
    if len(rest) not in (4, 5):
        raise ValueError(f"EDGE_RANGE has {len(rest)} fields; {RANGE}")
    try:
        a, b = rest[-4:-2]
        when = text_lines.number(rest[0]) if len(rest) > 4 else None
        return _Range(when, a, b, text_lines.numbers(rest[-2:], "range variance")[0])
    except ValueError as error:
        raise ValueError(f"EDGE_RANGE {' '.join(rest)[:80]}: {error}; {RANGE}") from None


def _long_enough(kind: str, rest: list[str], count: int, names: str) -> None:
    if len(rest) != count:
        raise ValueError(f"{kind} has {len(rest)} fields; {names} belong there")


def read(path: Path) -> Recording:
    """Read one file.

    Raises:
        BadRecording: not a pyfg file, or one without odometry.
    """
    file = _File()
    for number, words in text_lines.worded(path):
        try:
            file.take(words)
        except ValueError as error:
            raise BadRecording(f"{path.name} line {number}: {error}") from None
    chains = file.chains()
    if not chains:
        raise BadRecording(f"{path.name}: no EDGE_SE2 line, so no odometry to play; {KINDS}")
    try:
        odometry = {robot: _odometry(keys, file) for robot, keys in chains.items()}
        times = _range_times(file)
    except ValueError as error:
        raise BadRecording(f"{path.name}: {error}") from None
    standing = file.nodes.keys() | {file.owner(key) for r in file.ranges for key in (r.a, r.b)}
    names = [*chains, *sorted(standing - set(chains))]
    ids = {name: k for k, name in enumerate(names)}
    start = min([_began(edges, file) for edges in odometry.values()] + times) - 0.1
    trails = {ids[r]: _trail(ids[r], edges, file, start) for r, edges in odometry.items()}
    rows = [
        (t - start, ids[file.owner(r.a)], ids[file.owner(r.b)], r.metres)
        for t, r in zip(times, file.ranges, strict=True)
    ]
    table = np.array(rows, dtype=float).reshape(-1, 4)
    used = sum(len(edges) for edges in odometry.values())
    notes: dict[str, object] = {"closures left out": len(file.edges) + file.more_edges - used}
    places = {ids[name]: (x, y) for name, (x, y) in file.nodes.items() if ids[name] not in trails}
    ranges = table[np.argsort(table[:, 0], kind="stable")]
    return Recording(path.name, trails, ranges, notes, nodes=places)


def _odometry(keys: list[str], file: _File) -> list[_Edge]:
    """The edges from each key to the next.

    Raises:
        ValueError: one is missing, a pose has no truth, or nobody knows when they were.
    """
    found = []
    for start, end in itertools.pairwise(keys):
        edge, back = file.edges.get((start, end)), file.edges.get((end, start))
        if edge is None and back is None:
            raise ValueError(f"no EDGE_SE2 from {start} to {end}, so the odometry is broken there")
        if edge is None and back is not None:
            reverse = metrics.relative(np.array(back.step), np.zeros(3))
            edge = _Edge(
                file.truth[end][0] if end in file.truth else back.t, start, end, [*reverse]
            )
        assert edge is not None
        found.append(edge)
    if len(found) > 1 and len({edge.t for edge in found}) == 1:
        raise ValueError(
            f"all poses from {keys[0]} to {keys[-1]} have one stamp; seconds belong there"
        )
    missing = [key for key in keys if key not in file.truth]
    if missing:
        raise ValueError(f"no VERTEX_SE2 {missing[0]}, so nothing to score against")
    return found


def _range_times(file: _File) -> list[float]:
    """When each range was measured.

    Raises:
        ValueError: neither it nor its poses say so.
    """
    said = {r.t for r in file.ranges}
    is_said = None not in said and (len(said) > 1 or len(file.ranges) < 2)
    out = []
    for r in file.ranges:
        poses = [file.truth[key][0] for key in (r.a, r.b) if key in file.truth]
        if is_said and r.t is not None:
            out.append(r.t)
        elif poses:
            out.append(poses[0])
        else:
            raise ValueError(f"EDGE_RANGE {r.a} {r.b} has no time, and neither has a VERTEX_SE2")
    return out


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
