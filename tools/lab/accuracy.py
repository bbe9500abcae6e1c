"""tools/accuracy: every real recording, one set of parameters, one table: reached against wanted.

Exit codes: 0 every figure is reached, 1 some are not, 2 wrong usage, 66 no recordings there.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from lab.accuracy_rows import ROWS, Figure
from lab.recording import BadRecording

NOT_REACHED, NO_INPUT = 1, 66

EXAMPLES = f"""\
examples:
  tools/accuracy data                         everything; what is not there is named
  tools/accuracy data --only vub swust        some rows: {", ".join(ROWS)}
  tools/accuracy data --json accuracy.json    the same figures for a program
  tools/accuracy data --config other.toml     with sections added to every robot's configuration
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    options = _parser().parse_args(arguments)
    extra = options.config.read_text() if options.config else ""
    figures: list[Figure] = []
    for name in options.only or ROWS:
        row = ROWS[name]
        if not (options.data / row.needs).exists():
            print(f"{name}: no {options.data / row.needs}", file=sys.stderr)
            continue
        print(f"{name} ...", file=sys.stderr, flush=True)
        try:
            figures += row.measure(options.data, extra)
        except BadRecording as error:
            print(error, file=sys.stderr)
            return NO_INPUT
    if not figures:
        return NO_INPUT
    print("\n".join(markdown(figures)))
    if options.json:
        rows = [{**asdict(figure), "is_reached": figure.is_reached} for figure in figures]
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0 if all(figure.is_reached for figure in figures) else NOT_REACHED


def markdown(figures: list[Figure]) -> list[str]:
    """The table."""
    lines = ["| recording | measure | reached | wanted | |", "| --- | --- | --- | --- | --- |"]
    for f in figures:
        sign = "at least" if f.is_least else "at most"
        mark = "yes" if f.is_reached else "**no**"
        lines.append(
            f"| {f.recording} | {f.measure} | {f.reached:.3g} {f.unit} "
            f"| {sign} {f.wanted:g} {f.unit} | {mark} |"
        )
    return lines


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/accuracy",
        description="Play real recordings to the team in virtual time; a table of what it reaches.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("data", type=Path, metavar="FOLDER", help="of the recordings' folders")
    parser.add_argument("--only", nargs="+", choices=list(ROWS), metavar="ROW")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures there")
    parser.add_argument("--config", type=Path, metavar="TOML", help="sections for every robot")
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
