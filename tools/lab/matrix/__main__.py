"""tools/matrix: the page of the fault matrix anew, and which rows no test names.

Exit codes: 0 every row has a test, 1 some have none, 2 wrong usage.
"""

from __future__ import annotations

import argparse

from lab.matrix import page
from lab.soak import results

EXAMPLES = """\
examples:
  tools/matrix          write tools/lab/matrix/matrix.md anew
  tools/matrix --check  only say what is missing
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
    options = parser.parse_args(arguments)
    tests = page.named_rows()
    if not options.check:
        page.PAGE.write_text("\n".join(page.page(tests, results.read(page.RUNS))) + "\n")
    absent = [*page.missing(tests), *page.unknown(tests)]
    print(f"rows without a test, or tests without a row: {', '.join(absent) or 'none'}")
    return 1 if absent else 0


if __name__ == "__main__":
    raise SystemExit(main())
