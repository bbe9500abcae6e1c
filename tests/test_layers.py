"""The shape of the package, read off its imports: rings, order, size, no cycles."""

from __future__ import annotations

import ast
import functools
import subprocess
import sys
from pathlib import Path

import pytest
from places import REPOSITORY

PACKAGE = REPOSITORY / "drslamd"
TESTS = REPOSITORY / "tests"
GENERATED = PACKAGE / "lcmtypes"
LAB = REPOSITORY / "tools" / "lab"

RINGS = {
    "vocabulary": ["conventions", "events", "config_faults", "config_wheels", "config"],
    "pure": [
        "sensors",
        "slam",
        "lcmtypes",
        "history",
        "gossip",
        "recording",
        "setup",
        "memory",
        "neighbourhood",
        "timers",
        "jobs",
        "whereabouts",
        "standing",
        "broadcast",
        "near",
        "conditions",
        "modules",
        "robot",
        "reports",
        "report",
    ],
    "shell": ["host", "io", "export"],
    "entry": ["parts", "machine", "doctor", "daemon", "view", "feed", "cli", "__main__"],
}
"""From the inside out; a module imports only from its own ring and those before it."""

PURE_ORDER = RINGS["pure"]
"""Inside the pure ring: each knows only what stands before it."""

SLAM_ORDER = [
    "headway",
    "se2",
    "chi_squared",
    "range_model",
    "lapack",
    "odometry",
    "robot_model",
    "graph",
    "pose_now",
    "peer_in_range",
    "relative_pose",
    "relocation",
    "points",
    "consistency",
    "hypotheses",
    "calibration",
    "optimizer",
    "closure_method",
    "tuning",
    "settings",
    "range_watch",
    "doubt",
    "revisions",
    "keyframe_selector",
    "front_end",
    "back_end",
]
"""The rooms of `slam` and what stands beside them, in the order of the paper."""

OPTIMIZER_ORDER = [
    "bias_prior",
    "mounting_prior",
    "sensor_priors",
    "problem",
    "factor_errors",
    "complex_factors",
    "vertex_cover",
    "mirror_factors",
    "factors",
    "near_pairs",
    "range_weights",
    "valleys",
    "contract",
    "banded",
    "kept",
    "closures",
    "rbcd",
]
"""Inside module 3: the three solvers know what is common to them, and `rbcd` claims what `closures`
does."""

KNOWS_CONFIG = {"keyframe_selector", "front_end", "back_end", "settings"}
"""Where the configuration ends; rooms get numbers."""

MAX_MODULES = 16
"""Of one folder."""

CLOCKS_AND_CHANCE = {"time", "datetime", "random", "secrets"}
THREADS_AND_PROCESSES = {"asyncio", "threading", "concurrent", "multiprocessing", "subprocess"}
PORTS_AND_FILES = {"os", "signal", "socket", "serial", "can", "lcm", "logging", "structlog"}
IMPURE = CLOCKS_AND_CHANCE | THREADS_AND_PROCESSES | PORTS_AND_FILES

MAX_FILE, MAX_FUNCTION = 350, 60

NOUNS = {
    "cli.exit_codes",
    "conventions",
    "events",
    "gossip.message_types",
    "io.transport",
    "machine.finding",
    "recording.records",
    "sensors.samples",
    "slam.graph.measurements",
    "slam.optimizer.banded.solution",
    "slam.optimizer.contract",
    "slam.peer_in_range",
    "slam.relative_pose.estimate",
    "slam.tuning",
}
"""Modules that hold only nouns, types or protocols: what uses them is tested."""

SAID_OF_MANY = {"solve", "descend"}
"""Verbs that their module qualifies."""


@functools.cache
def modules() -> tuple[Path, ...]:
    return tuple(sorted(p for p in PACKAGE.rglob("*.py") if GENERATED not in p.parents))


@functools.cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@functools.cache
def name_of(path: Path) -> str:
    parts = list(path.relative_to(REPOSITORY).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@functools.cache
def imports_of(path: Path) -> frozenset[str]:
    """Dotted names that a module imports when it runs (not only for type checking)."""
    found: set[str] = set()
    tree = parsed(path)
    for_types = {
        id(node)
        for branch in ast.walk(tree)
        if isinstance(branch, ast.If) and "TYPE_CHECKING" in ast.unparse(branch.test)
        for node in ast.walk(branch)
    }
    for node in ast.walk(tree):
        if id(node) in for_types:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
    return frozenset(found)


def part_of(name: str) -> str | None:
    """The first name below drslamd, None for the package itself and for others."""
    parts = name.split(".")
    return parts[1] if parts[0] == "drslamd" and len(parts) > 1 else None


def ring_of(part: str) -> int:
    for number, parts in enumerate(RINGS.values()):
        if part in parts:
            return number
    raise AssertionError(f"drslamd.{part} belongs to no ring: give it one in {__file__}")


def test_a_module_imports_only_inwards() -> None:
    outwards = [
        f"{name_of(path)} imports {imported}"
        for path in modules()
        for imported in imports_of(path)
        if is_outwards(part_of(name_of(path)), part_of(imported))
    ]
    assert outwards == []


def is_outwards(part: str | None, other: str | None) -> bool:
    """Would a part import one that stands further out, or later in the pure ring?"""
    if part is None or other is None or not is_part(other):
        return False
    if part in PURE_ORDER and other in PURE_ORDER:
        return PURE_ORDER.index(other) > PURE_ORDER.index(part)
    return ring_of(other) > ring_of(part)


def is_part(other: str) -> bool:
    return (PACKAGE / other).exists() or (PACKAGE / f"{other}.py").exists()


def room_of(name: str, order: list[str], below: str) -> int | None:
    """Where the next name below a package stands in its order, None for others."""
    if not name.startswith(below + "."):
        return None
    room = name.removeprefix(below + ".").split(".")[0]
    assert room in order, f"{below}.{room} has no place in {__file__}"
    return order.index(room)


@pytest.mark.parametrize(
    ("below", "order"),
    [("drslamd.slam", SLAM_ORDER), ("drslamd.slam.optimizer", OPTIMIZER_ORDER)],
)
def test_a_room_knows_only_rooms_below_it(below: str, order: list[str]) -> None:
    names = {name_of(path) for path in modules()}
    for path in modules():
        here = room_of(name_of(path), order, below)
        for imported in imports_of(path) & names if here is not None else ():
            there = room_of(imported, order, below)
            assert there is None or here is None or there <= here, (name_of(path), imported)


def test_the_rooms_of_slam_get_numbers_and_not_the_configuration() -> None:
    for path in modules():
        name = name_of(path)
        if name.startswith("drslamd.slam.") and name.split(".")[2] not in KNOWS_CONFIG:
            assert not any(i.startswith("drslamd.config") for i in imports_of(path)), name


def test_no_folder_has_more_than_a_newcomer_can_look_over() -> None:
    folders = {p.parent for p in modules()} | {p.parent for p in LAB.rglob("*.py")}
    for folder in folders:
        count = sum(p.name not in ("__init__.py", "__main__.py") for p in folder.glob("*.py"))
        assert count <= MAX_MODULES, folder


def definitions(path: Path) -> list[ast.ClassDef | ast.FunctionDef]:
    """Public classes and functions of a module."""
    body = parsed(path).body
    return [
        node
        for node in body
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_")
    ]


def test_no_name_stands_for_two_things() -> None:
    """Classes of the package, and all public names of `slam`; a verb may be said of two modules."""
    places: dict[str, list[str]] = {}
    for path in modules():
        for node in definitions(path):
            if isinstance(node, ast.ClassDef) or "slam" in path.parts:
                places.setdefault(node.name, []).append(name_of(path))
    double = {name: where for name, where in places.items() if len(where) > 1}
    assert set(double) <= SAID_OF_MANY, double


@pytest.mark.row("T1")
def test_the_inner_rings_touch_no_clock_no_socket_no_file() -> None:
    for path in modules():
        part = part_of(name_of(path))
        if part is None or ring_of(part) > list(RINGS).index("pure"):
            continue
        impure = {name.split(".")[0] for name in imports_of(path)} & IMPURE
        assert not impure, f"{name_of(path)} imports {impure}"
        calls = [node.func for node in ast.walk(parsed(path)) if isinstance(node, ast.Call)]
        names = {call.id for call in calls if isinstance(call, ast.Name)}
        assert not {"open", "print", "input"} & names, name_of(path)


def test_there_is_no_import_cycle() -> None:
    names = {name_of(path): path for path in modules()}
    graph = {
        name: {i for i in imports_of(path) if i in names and i != name}
        for name, path in names.items()
    }
    done: set[str] = set()
    while len(done) < len(graph):
        free = {n for n in graph if n not in done and graph[n] <= done | {"drslamd"}}
        assert free, f"a cycle among {sorted(set(graph) - done)}"
        done |= free


def test_every_module_has_a_test_that_one_finds_by_its_name() -> None:
    """In the folder that mirrors the package; what is about whole robots is in `robot`."""
    names = {name_of(p).removeprefix("drslamd."): p for p in modules() if "__" not in p.name}
    assert set(names) >= NOUNS
    for name, path in names.items():
        folder = TESTS / path.parent.relative_to(PACKAGE)
        places = [folder, TESTS / "robot"] if folder == TESTS else [folder]
        is_found = any((place / f"test_{path.name}").exists() for place in places)
        assert is_found is (name not in NOUNS), name


@pytest.mark.slow
def test_every_module_can_be_imported_alone() -> None:
    names = [name_of(path) for path in modules() if path.name != "__main__.py"]
    code = (
        "import importlib, sys\n"
        f"for name in {names!r}:\n"
        "    for loaded in [m for m in sys.modules if m.startswith('drslamd')]:\n"
        "        del sys.modules[loaded]\n"
        "    importlib.import_module(name)\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], cwd=REPOSITORY, check=True)


def test_the_daemon_does_not_load_what_only_a_choice_needs() -> None:
    code = (
        "import sys, drslamd.daemon\n"
        "heavy = {'lcm', 'can', 'cantools', 'scipy.stats', 'scipy.optimize', 'matplotlib'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, check=True, capture_output=True, text=True
    )
    assert answer.stdout.strip() == "[]"


def test_files_and_functions_stay_small() -> None:
    for path in modules():
        assert path.read_text().count("\n") <= MAX_FILE, name_of(path)
        for node in ast.walk(parsed(path)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                assert node.end_lineno is not None
                lines = node.end_lineno - node.lineno + 1
                assert lines <= MAX_FUNCTION, (name_of(path), node.name)


def test_the_top_level_is_what_the_user_fixed() -> None:
    rooms = {"drslamd", "systemd", "etc", "tools", "tests", ".ci"}
    allowed = rooms | {"pyproject.toml", "README.md", ".gitignore"}
    tracked = subprocess.run(
        ["git", "ls-files"], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    if tracked.returncode:
        pytest.skip("not a git checkout")
    assert {line.split("/")[0] for line in tracked.stdout.splitlines()} <= allowed
