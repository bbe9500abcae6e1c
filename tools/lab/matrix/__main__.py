"""tools/matrix: the page of the fault matrix anew, and which rows no test names.

Exit codes: 0 every row has a test, 1 some have none or a test failed, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys

from lab.files import keep
from lab.matrix import measuring, page
from lab.soak import results

EXAMPLES = """\
examples:
  tools/matrix          write tools/lab/matrix/matrix.md anew
  tools/matrix --check  only say what is missing
  tools/matrix --measure                        run all tests of rows and keep what they find
  tools/matrix --measure tests/sensors -m "row and not slow"  some of them, by arguments of pytest
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/matrix",
        description="Which test names which row of the fault matrix?",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--check", action="store_true", help="write nothing")
    parser.add_argument("--measure", nargs=argparse.REMAINDER, help="run tests, then write")
    options = parser.parse_args(arguments)
    failed = options.measure is not None and _measured(options.measure)
    code = 0
    tests = page.named_rows()
    if not options.check:
        made = page.page(tests, results.read(page.RUNS), measuring.read(measuring.FOUND))
        code = keep(page.PAGE, "\n".join(made) + "\n")
    absent = [*page.missing(tests), *page.unknown(tests)]
    print(f"rows without a test, or tests without a row: {', '.join(absent) or 'none'}")
    return 1 if absent or failed else code


def _measured(chosen: list[str]) -> bool:
    """Run tests of rows; did any fail?"""
    options = ["-q", "-p", "lab.matrix.measuring", *([] if "-m" in chosen else ["-m", "row"])]
    command = [sys.executable, "-m", "pytest", *options, *chosen]
    environment = {**os.environ, measuring.WHERE: str(measuring.FOUND)}
    environment.setdefault("OPENBLAS_NUM_THREADS", "1")
    return subprocess.run(command, cwd=page.ROOT, env=environment, check=False).returncode != 0


if __name__ == "__main__":
    raise SystemExit(main())
