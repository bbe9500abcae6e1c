"""tools/planted: is each of these bugs seen by a test that names a row of the fault matrix?

Exit codes: 0 all are caught, 1 some are not, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from lab.hunt.copies import copied, ran
from lab.hunt.plants import PLANTS, Plant
from lab.progress import Progress

ESCAPED = 1

EXAMPLES = """\
examples:
  tools/planted                            all of them, about three minutes
  tools/planted wrong-clock nan-passed     these
  tools/planted --list                     their names
"""


def main(arguments: list[str] | None = None) -> int:
    """Plant them one by one; the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/planted",
        description="Plant known bugs in a copy of the tree; which row catches each?",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("bug", nargs="*", metavar="BUG", help="a bug, by default all")
    parser.add_argument("--list", action="store_true", help="name the bugs and end")
    options = parser.parse_args(arguments)
    if options.list:
        print("\n".join(f"{plant.name:<26} drslamd/{plant.path}" for plant in PLANTS.values()))
        return 0
    unknown = [name for name in options.bug if name not in PLANTS]
    if unknown:
        parser.error(f"{unknown[0]!r} is none of: {', '.join(PLANTS)}")
    chosen = [PLANTS[name] for name in options.bug] or list(PLANTS.values())
    progress, escaped = Progress("planted", len(chosen), "bugs"), 0
    print("| bug | in | row | test that caught it |\n| --- | --- | --- | --- |")
    with copied() as folder:
        for done, plant in enumerate(chosen, start=1):
            rows, test = verdict(folder, plant)
            escaped += not rows
            print(f"| {plant.name} | `{plant.path}` | {rows or '**none**'} | {test} |", flush=True)
            progress(done)
    progress.end()
    print(f"\n{len(chosen) - escaped} of {len(chosen)} planted bugs are caught by a row.")
    return ESCAPED if escaped else 0


def verdict(folder: Path, plant: Plant) -> tuple[str, str]:
    """The rows of the test that failed, and its name; the file is then as it was."""
    path = folder / "drslamd" / plant.path
    sound = path.read_text()
    path.write_text(broken(sound, plant))
    try:
        found = ran(folder, [f"tests/{test}" for test in plant.tests])
    finally:
        path.write_text(sound)
    named = {name: rows for name, rows in found.failed.items() if rows}
    for name, rows in (named or found.failed).items():
        return ", ".join(rows), re.sub(r"\[.*", "", name.split("::")[-1])
    if not found.is_green:
        print(found.said, file=sys.stderr)
        return "", "the tests do not begin"
    return "", "all tests pass"


def broken(text: str, plant: Plant) -> str:
    """The file with the bug in it.

    Raises:
        AssertionError: what is to be replaced does not stand there once.
    """
    if text.count(plant.old) != 1:
        raise AssertionError(f"{plant.name}: {plant.path} has {text.count(plant.old)} such places")
    out = text.replace(plant.old, plant.new)
    # a clock that was not needed before
    return out if "import time\n" in out or "time." not in plant.new else _with_time(out)


def _with_time(text: str) -> str:
    first = "from __future__ import annotations\n"
    return text.replace(first, first + "\nimport time\n", 1)


if __name__ == "__main__":
    sys.exit(main())
