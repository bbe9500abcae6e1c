"""tools/trust: do published poses know what they do not know?

Exit codes: 0 every promise is kept, 1 some are not, 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os

from lab.files import keep, result_file
from lab.numbers import whole
from lab.trust import play, table
from lab.trust.cases import CASES, QUICK
from lab.trust.play import Trusted

BROKEN = 1

EXAMPLES = """\
examples:
  tools/trust                              everything, about an hour of one core
  tools/trust --quick                      a few cases with a seed or two, under 40 s
  tools/trust slip blocked --seeds 3       these cases, three seeds each
  tools/trust slip --seeds 5 --first 2000  drives that nobody has looked at yet
  tools/trust clean-3 --json clean.json    also every figure, ATE and sentence for a program
  tools/trust --list                       the names of all cases
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.list:
        print("\n".join(f"{c.name:<14} {c.seeds:>3} seeds  {c.what}" for c in CASES.values()))
        return 0
    usual = QUICK if options.quick else {name: case.seeds for name, case in CASES.items()}
    names = options.case or list(usual)
    seeds = {name: options.seeds or usual.get(name, 1) for name in names}
    found = play.trusted(seeds, options.jobs, options.first)
    print("\n".join(page(found)))
    code = keep(options.json, json.dumps(play.as_json(found), indent=1) + "\n")
    kept = [check.is_kept for trusted in found for check in trusted.checks]
    return code if all(kept) else BROKEN


def page(found: list[Trusted]) -> list[str]:
    """All tables."""
    worlds = {t.title: t.figures for t in found if not t.case.twin}
    faults = {t.title: t.figures for t in found if t.case.cause.about}
    out = []
    if worlds:
        out += ["What is claimed:", "", *table.poses(worlds), ""]
    if faults:
        out += ["What is said of faults:", "", *table.faults(faults), ""]
    checks = [check for trusted in found for check in trusted.checks]
    return [*out, "Promises:", "", *table.promised(checks)]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/trust",
        description="Play worlds and faults to the team in virtual time; is what it claims true?",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("case", nargs="*", metavar="CASE", help="all of them when left out")
    parser.add_argument("--quick", action="store_true", help="a few cases, few seeds")
    parser.add_argument(
        "--seeds", type=whole(1), metavar="N", help="of each case, not its usual number"
    )
    parser.add_argument(
        "--first", type=whole(), metavar="N", help="seed of each case, not its usual one"
    )
    parser.add_argument(
        "--jobs", type=whole(1), default=os.cpu_count() or 1, metavar="N", help="at once"
    )
    parser.add_argument("--json", type=result_file, metavar="FILE", help="write all figures there")
    parser.add_argument("--list", action="store_true", help="name the cases")
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
