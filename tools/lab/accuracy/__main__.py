"""tools/accuracy: every real recording, one set of parameters, one table: reached against wanted.

Exit codes: 0 every figure is reached, 1 some are not, 2 wrong usage, 66 no recordings there.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from lab.accuracy.ablation import PIECES, Piece
from lab.accuracy.accuracy_rows import ROWS, Figure, Setup
from lab.files import keep, result_file, sections
from lab.recordings.recording import BadRecording

NOT_REACHED, NO_INPUT = 1, 66

EXAMPLES = f"""\
examples:
  tools/accuracy data                         everything; what is not there is named
  tools/accuracy data --only vub swust        some rows: {", ".join(ROWS)}
  tools/accuracy data --json accuracy.json    the same figures for a program
  tools/accuracy data --config other.toml     with sections added to every robot's configuration
  tools/accuracy data --without nlos          what a piece brings: {", ".join(PIECES)}
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    piece = PIECES[options.without] if options.without else Piece("")
    try:
        extra = sections(options.config)
        if piece.section and f"[{piece.section}]" in extra:
            parser.error(f"--without {options.without} needs [{piece.section}], as does --config")
        setup = Setup(extra + piece.toml, piece.tuning)
        figures = _measured(options.data, options.only or list(ROWS), setup)
    except BadRecording as error:
        print(error, file=sys.stderr)
        return NO_INPUT
    if not figures:
        return NO_INPUT
    if options.without:
        print(f"Without {options.without}: {piece.instead}.\n")
    print("\n".join(markdown(figures)))
    rows = [{**asdict(figure), "is_reached": figure.is_reached} for figure in figures]
    code = keep(options.json, json.dumps(rows, indent=1) + "\n")
    return code if all(figure.is_reached for figure in figures) else NOT_REACHED


def _measured(data: Path, names: list[str], setup: Setup) -> list[Figure]:
    """The figures of these rows; what is not there is named.

    Raises:
        BadRecording: a recording cannot be read.
    """
    figures: list[Figure] = []
    for name in names:
        row = ROWS[name]
        if not (data / row.needs).exists():
            print(f"{name}: no {data / row.needs}", file=sys.stderr)
            continue
        print(f"{name} ...", file=sys.stderr, flush=True)
        figures += row.measure(data, setup)
    return figures


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
    parser.add_argument("--json", type=result_file, metavar="FILE", help="write all figures there")
    parser.add_argument("--config", type=Path, metavar="TOML", help="sections for every robot")
    parser.add_argument("--without", choices=list(PIECES), metavar="PIECE", help="leave one out")
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
