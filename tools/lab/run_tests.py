"""tools/test: lint, types, and the suite on every interpreter that is found.

On the interpreter of .venv everything runs. The others import every test and share the quick ones
among them, of three each every third: what depends on an interpreter is its syntax and its library,
not a number, and types are checked for the oldest. Exit code 0 only when everything passed.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
SUPPORTED = ("3.10", "3.11", "3.12", "3.13")
SIDE_BY_SIDE = (
    *("tests/gossip", "tests/near", "tests/robot", "tests/slam"),
    *("tests/lab/accuracy", "tests/lab/bound", "tests/lab/hunt", "tests/lab/near"),
    *("tests/lab/replay", "tests/lab/report", "tests/lab/reproduce", "tests/lab/soak"),
    *("tests/lab/trust", "tests/system/test_honest_poses.py", "tests/test_layers.py"),
    *("tests/deploy/test_package.py", "tests/deploy/test_lines_for_a_clone.py"),
)
"""Slow here are virtual time and packages that are built, which may share the machine; what runs in
real time may not."""
SHOWN = 4_000
"""Characters of the end of what another interpreter says."""

EXAMPLES = """\
examples:
  tools/test              everything, on every interpreter that is found
  tools/test --quick      what runs all day: lint, types, the quick tests, this interpreter
  tools/test -- -k clock  arguments after -- go to pytest (this interpreter, no lint)
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/test",
        description="Lint, types, tests.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="under three minutes")
    parser.add_argument("pytest", nargs="*", help="arguments for pytest")
    options = parser.parse_args(arguments)
    python = sys.executable
    if options.pytest:
        return _run("tests", python, "-m", "pytest", *options.pytest)
    steps = [
        ("lint", [python, "-m", "ruff", "check", "drslamd", "tools", "tests"]),
        ("format", [python, "-m", "ruff", "format", "--check", "drslamd", "tools", "tests"]),
        # as many at once as there are cores
        ("quick tests", [python, "-m", "pytest", "-q", "-n", "auto", "-m", "not slow"]),
    ]
    if not options.quick:
        slow = [python, "-m", "pytest", "-q", "-m", "slow"]
        # what the tests of a file have in common, such as a package, is made once
        together = [*slow, "-n", "auto", "--dist", "loadfile", *SIDE_BY_SIDE]
        others = [f"--ignore={folder}" for folder in SIDE_BY_SIDE]
        steps.append(("slow tests side by side", together))
        steps.append(("slow tests one by one", [*slow, *others]))
    types = [python, "-m", "mypy", "drslamd", "tools/lab", *_test_files()]
    with ThreadPoolExecutor(1) as pool:
        # they take the time in which tests wait
        beside = pool.submit(_run, "types", *types, shown=False)
        failed = [name for name, command in steps if _run(name, *command)]
        failed += ["types"] if beside.result() else []
    if not options.quick:
        failed += _other_interpreters()
    print(f"FAILED: {', '.join(failed)}" if failed else "all passed")
    return 1 if failed else 0


def _test_files() -> list[str]:
    """mypy wants them one by one: their folders are no packages."""
    return [str(path.relative_to(ROOT)) for path in sorted((ROOT / "tests").rglob("*.py"))]


def _run(name: str, *command: str, shown: bool = True) -> int:
    """Its exit code; what is not shown while it runs is printed at its end, if it failed."""
    began = time.monotonic()
    if shown:
        print(f"== {name}", flush=True)
    done = subprocess.run(
        command, cwd=ROOT, env=_as_users(), check=False, text=True, capture_output=not shown
    )
    if not shown and done.returncode:
        print(f"\n== {name}\n{done.stdout}{done.stderr}")
    _ended(name, done.returncode, began)
    return done.returncode


def _as_users() -> dict[str, str]:
    """The environment in which bytecode is kept, whatever that of the caller says: without it each
    daemon that a test starts compiles all modules anew, which takes it longer than all the rest."""
    kept = os.environ.copy()
    kept.pop("PYTHONDONTWRITEBYTECODE", None)
    return kept


def _ended(name: str, code: int, began: float) -> None:
    verdict, seconds = "ok" if code == 0 else "FAILED", time.monotonic() - began
    print(f"== {name}: {verdict}, {seconds:.0f} s", flush=True)


def _other_interpreters() -> list[str]:
    """The quick tests on the other supported interpreters that are found; those that failed."""
    own = f"{sys.version_info.major}.{sys.version_info.minor}"
    others = {version: _find(version) for version in SUPPORTED if version != own}
    found = {version: python for version, python in others.items() if python is not None}
    # one after the other on all cores: side by side, three on two cores would take two rounds
    codes = [
        _quick_tests_on(version, python, f"{part}/{len(found)}")
        for part, (version, python) in enumerate(found.items(), start=1)
    ]
    absent = ", ".join(version for version in others if version not in found)
    print(f"interpreters not found, so not tested: {absent or 'none'}")
    return [f"Python {v}" for v, code in zip(found, codes, strict=True) if code]


def _quick_tests_on(version: str, python: str, share: str) -> int:
    """In an environment of its own; what is said is printed at the end."""
    began, folder = time.monotonic(), ROOT / ".venvs" / version
    inside = str(folder / "bin" / "python")
    # most of what is installed is never imported here, so nothing is compiled before it is
    install = [inside, "-m", "pip", "install", "--quiet", "--no-compile", "--editable"]
    quick = [inside, "-m", "pytest", "-q", "-n", "auto", "-m", "not slow", "--share", share]
    steps = [[*install, f"{ROOT}[test]"], [*quick, "-p", "no:cacheprovider"]]
    # pip comes last: an environment without it was begun and not ended
    if not (folder / "bin" / "pip").exists():
        steps.insert(0, [python, "-m", "venv", "--clear", str(folder)])
    code = 0
    for step in steps:
        done = subprocess.run(
            step, cwd=ROOT, env=_as_users(), check=False, text=True, capture_output=True
        )
        code = done.returncode
        if code:
            break
    print(done.stdout[-SHOWN:] + (done.stderr[-SHOWN:] if code else ""))
    _ended(f"quick tests on Python {version}", code, began)
    return code


def _find(version: str) -> str | None:
    """An interpreter of this version that really runs."""
    name = f"python{version}"
    homes = [Path.home() / ".pyenv" / "versions", Path.home() / ".local/share/uv/python"]
    places = [Path(p) / name for p in os.environ.get("PATH", "").split(os.pathsep)]
    places += [p for home in homes for p in sorted(home.glob(f"*{version}*/bin/{name}"))]
    for place in places:
        if place.exists() and _says(str(place)) == version:
            return str(place)
    return None


def _says(python: str) -> str:
    code = "import sys, venv; print('%d.%d' % sys.version_info[:2])"
    try:
        answer = subprocess.run(
            [python, "-c", code], capture_output=True, text=True, timeout=20, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return answer.stdout.strip()


if __name__ == "__main__":
    raise SystemExit(main())
