"""tools/benchmark: every module beside its peers, on one core.

Exit codes: 0 done, 1 with --check: something became worse, 2 wrong usage, 66 no pose graphs.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from lab.benchmark import (
    curves,
    daemon,
    graphs,
    growth,
    module1,
    module2,
    module3,
    pipeline,
    rows,
    sdp,
    timing,
    traffic,
)
from lab.benchmark.large_teams import large_loop, one_more_second
from lab.benchmark.rows import Row
from lab.files import keep, result_file
from lab.progress import Progress
from lab.recordings.recording import BadRecording

WORSE, NO_INPUT = 1, 66
PARTS = {
    "1": module1,
    "sdp": sdp,
    "2": module2,
    "3": module3,
    "one-more-second": one_more_second,
    "all": pipeline,
    "daemon": daemon,
    "large-loop": large_loop,
    "traffic": traffic,
    "growth": growth,
}
EXAMPLES = """\
examples:
  tools/benchmark --json now.json              all of it, an hour or two; until then rows that are
                                               measured stand in now-unfinished.json
  tools/benchmark --quick --json now.json      under two minutes, fewer repetitions
  tools/benchmark --quick --check before.json  and say what became worse
  tools/benchmark --module 3                   one module
  tools/benchmark --module one-more-second     what a second of a large team costs

Times are CPU time on one core. Peers "in this run" take turns with drslamd on the same inputs;
"elsewhere" are figures of another machine, from papers or measured once. Only ratios compare.
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    options = _parser().parse_args(arguments)
    try:
        stored = (
            rows.from_json(json.loads(options.check.read_text())["rows"]) if options.check else []
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        print(f"{options.check}: no results of tools/benchmark: {error}", file=sys.stderr)
        return NO_INPUT
    timing.pin()
    try:
        found = _run(options.module or _possible(), options.quick, options.json)
    except (OSError, BadRecording) as error:
        print(f"{error}; DRSLAMD_POSEGRAPHS names the folder", file=sys.stderr)
        return NO_INPUT
    print(f"{_machine()}\n\n{rows.markdown(found)}")
    code = 0
    if options.json:
        code = keep(options.json, _stored(found, options.quick))
        if code == 0:
            _unfinished(options.json).unlink(missing_ok=True)
    if options.picture:
        code = curves.draw(found, options.picture) or code
    worse = rows.regressions(found, stored)
    for sentence in worse:
        print(f"worse: {sentence}", file=sys.stderr)
    return WORSE if worse else code


def _possible() -> list[str]:
    """All parts; without the graphs all but module 3, which is said."""
    if graphs.FOLDER.is_dir():
        return list(PARTS)
    print(f"no pose graphs in {graphs.FOLDER}, so module 3 is left out", file=sys.stderr)
    return [part for part in PARTS if part != "3"]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/benchmark",
        description="Time each module of drslamd beside its peers.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="fewer repetitions and graphs")
    parser.add_argument("--json", type=result_file, metavar="FILE", help="write all figures there")
    parser.add_argument(
        "--picture", type=result_file, metavar="FILE", help="draw what grows (.png, .svg)"
    )
    parser.add_argument("--check", type=Path, metavar="FILE", help="compare with an earlier --json")
    parser.add_argument("--module", action="append", choices=list(PARTS), help="only this one")
    return parser


def _run(parts: list[str], quick: bool, result: Path | None) -> list[Row]:
    progress, found = Progress("benchmark", len(parts), "parts"), []
    for done, part in enumerate(parts):
        progress(done)
        for row in PARTS[part].rows(quick):
            found.append(row)
            if result is not None:
                # a row may take a quarter of an hour: what ends the run does not take the others
                keep(_unfinished(result), _stored(found, quick))
    progress(len(parts))
    progress.end()
    return found


def _unfinished(result: Path) -> Path:
    return result.with_name(f"{result.stem}-unfinished{result.suffix}")


def _stored(found: list[Row], quick: bool) -> str:
    """A line for each row, so that a stored file can be read and compared."""
    lines = ",\n".join(json.dumps(row) for row in rows.to_json(found))
    head = json.dumps({"machine": _machine(), "quick": quick})[:-1]
    return f'{head}, "rows": [\n{lines}\n]}}\n'


def _machine() -> str:
    versions: dict[str, Any] = {
        "Python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }
    named = ", ".join(f"{name} {version}" for name, version in versions.items())
    return f"{platform.machine()}, one core, CPU time; {named}; graphs of {graphs.FOLDER.name}/"


if __name__ == "__main__":
    raise SystemExit(main())
