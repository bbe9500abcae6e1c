"""Reader and writer of ``.pyfg``, the text format of range-aided pose graphs (PyFactorGraph).

Lines (SE(2) only): ``VERTEX_SE2 t key x y yaw`` (truth), ``VERTEX_XY key x y`` (standing node),
``EDGE_SE2 t from to dx dy dyaw`` and six covariances, ``EDGE_RANGE t a b range variance``. A key
is a letter for the robot and a number; robots become ids in the order of their letters, standing
nodes follow them. A range belongs to the module of the robot named first, at its own stamp.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lab.recording import Array, BadRecording, Recording, Trail


def read(path: Path) -> Recording:
    """Read one file.

    Raises:
        BadRecording: not a pyfg file, or one without odometry.
    """
    truth: dict[str, tuple[float, ...]] = {}
    edges: dict[str, list[tuple[float, str, str, float, float, float]]] = {}
    ranges: list[tuple[float, str, str, float]] = []
    nodes: set[str] = set()
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0] == "VERTEX_SE2":
                truth[words[2]] = tuple(float(w) for w in words[3:6])
            elif words[0] == "VERTEX_XY":
                nodes.add(words[-3])
            elif words[0] == "EDGE_SE2":
                dx, dy, dyaw = (float(w) for w in words[4:7])
                edges.setdefault(words[2][0], []).append(
                    (float(words[1]), words[2], words[3], dx, dy, dyaw)
                )
            elif words[0] == "EDGE_RANGE":
                ranges.append((float(words[1]), words[2], words[3], float(words[4])))
        except (IndexError, ValueError) as error:
            raise BadRecording(f"{path.name} line {number}: {error}") from None
    if not edges:
        raise BadRecording(f"{path.name}: no EDGE_SE2 line, so no odometry to play")
    letters = sorted(edges)
    ids = {letter: k for k, letter in enumerate(letters)}
    for node in sorted(nodes):
        ids.setdefault(node[0], len(ids))
    start = min([*(e[0][0] for e in edges.values()), *(r[0] for r in ranges)]) - 0.1
    trails = {ids[s]: _trail(ids[s], edges[s], truth, start, path) for s in letters}
    table = np.array([(t - start, ids[a[0]], ids[b[0]], r) for t, a, b, r in ranges], dtype=float)
    table = table.reshape(-1, 4)
    return Recording(path.name, trails, table[np.argsort(table[:, 0], kind="stable")])


def _trail(
    robot: int,
    edges: list[tuple[float, str, str, float, float, float]],
    truth: dict[str, tuple[float, ...]],
    start: float,
    path: Path,
) -> Trail:
    """Chain the edges of one robot; the stamp of an edge is that of the pose it leads to."""
    pose = np.zeros(3)
    poses = [pose]
    times = [edges[0][0] - start - 0.05]
    keys = [edges[0][1]]
    for t, _, key, dx, dy, dyaw in edges:
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        pose = pose + [cos * dx - sin * dy, sin * dx + cos * dy, dyaw]
        poses.append(pose)
        times.append(max(t - start, times[-1] + 1e-4))
        keys.append(key)
    missing = [key for key in keys if key not in truth]
    if missing:
        raise BadRecording(f"{path.name}: no VERTEX_SE2 {missing[0]}, so nothing to score against")
    return Trail(robot, np.array(times), np.array(poses), np.array([truth[k] for k in keys]))


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
