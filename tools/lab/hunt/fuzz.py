"""tools/fuzz: bytes that nobody meant, to every decoder and to a whole robot.

Exit codes: 0 nothing was found, 1 something was, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from lab.hunt import flips, liar, volume
from lab.hunt.targets import TARGETS, seeds
from lab.numbers import real, whole
from lab.progress import Progress

FOUND = 1
SECONDS = 20
CORPUS = Path("out") / "fuzz"

EXAMPLES = """\
examples:
  tools/fuzz                               every decoder, 20 s each, guided by coverage (atheris)
  tools/fuzz uwb robot --seconds 300       these two, five minutes each
  tools/fuzz --datagrams 1e7 --bytes 1e8   so many malformed ones, counted; no atheris is needed
  tools/fuzz --flips 1e5                   frames of a LinkTrack module with two damaged bits
  tools/fuzz --lies 1e6                    a member of the team says so many well-formed lies
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/fuzz",
        description="Bytes that nobody meant, to every decoder and to a whole robot.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("target", nargs="*", metavar="TARGET", help=f"of: {', '.join(TARGETS)}")
    parser.add_argument("--seconds", type=whole(1), default=SECONDS, help="for each target")
    parser.add_argument("--datagrams", type=real(), default=0, metavar="N", help="malformed ones")
    parser.add_argument("--bytes", type=real(), default=0, metavar="N", help="of serial noise")
    parser.add_argument("--flips", type=real(), default=0, metavar="N", help="two bits in a frame")
    parser.add_argument("--lies", type=real(), default=0, metavar="N", help="of a member")
    options = parser.parse_args(arguments)
    for name in options.target:
        if name not in TARGETS:
            parser.error(f"{name!r} is none of: {', '.join(TARGETS)}")
    if options.datagrams or options.bytes or options.flips or options.lies:
        return _pour(options)
    if importlib.util.find_spec("atheris") is None:
        parser.error("atheris is not installed: pip install atheris, or count with --datagrams")
    return _guided(options.target or list(TARGETS), options.seconds)


class Result(Protocol):
    """How something that was poured in ended."""

    @property
    def is_kept(self) -> bool: ...

    def line(self) -> str: ...


def _pour(options: argparse.Namespace) -> int:
    """So many of each kind that was asked for."""
    pours: list[tuple[float, Callable[[int, Progress], Result]]] = [
        (options.datagrams, lambda many, told: volume.datagrams(many, told=told)),
        (options.bytes, lambda many, told: volume.serial_bytes(many, told=told)),
        (options.flips, lambda many, told: flips.double_flips(many, told=told)),
        (options.lies, lambda many, told: liar.compared(many, told)),
    ]
    kept = []
    for many, pour in pours:
        if many:
            progress = Progress("poured", many, "of them")
            result = pour(int(many), progress)
            progress.end()
            print(result.line(), flush=True)
            kept.append(result.is_kept)
    return 0 if all(kept) else FOUND


def _guided(names: list[str], seconds: int) -> int:
    """Each target in a process of its own, because atheris ends the one that it runs in."""
    failed, progress = 0, Progress("fuzzed", len(names) * seconds)
    for done, name in enumerate(names, start=1):
        corpus = CORPUS / name
        corpus.mkdir(parents=True, exist_ok=True)
        for number, data in enumerate(seeds()):
            (corpus / f"seed{number}").write_bytes(data)
        code = f"from lab.hunt.guided import fuzz; fuzz({name!r}, {str(corpus)!r}, {seconds})"
        ran = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=False
        )
        failed += ran.returncode != 0
        lines = [line for line in ran.stderr.splitlines() if "DONE" in line or "Error" in line]
        told = lines[-1].strip() if lines else ran.stderr[-400:]
        print(f"{name:<14} {'ok' if ran.returncode == 0 else 'FOUND'}  {told}", flush=True)
        progress(done * seconds)
    progress.end()
    return FOUND if failed else 0


if __name__ == "__main__":
    sys.exit(main())
