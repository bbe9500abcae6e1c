"""The command line of tools/reproduce.

Exit codes: 0 done and everything reached, 1 done and something not reached, 2 wrong usage, 66 no
recordings there, 130 broken off (what is done is kept).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from lab.bound import efficiency, first_pose
from lab.files import keep
from lab.numbers import whole
from lab.progress import Progress
from lab.reproduce import experiment, pages, pictures, plan, rbcd_table, verdict
from lab.reproduce.gyro import gyro_rows
from lab.reproduce.state import State
from lab.reproduce.tally import Tally

EXAMPLES = """\
examples:
  tools/reproduce --quick                   one seed, under three minutes
  tools/reproduce                           20 seeds, all tables; goes on where it stopped
  tools/reproduce --seeds 40 --out /tmp/x   more of them, elsewhere
  tools/reproduce --rbcd data               module 3 against its centralised optimum, 15 minutes
  tools/reproduce --rbcd data --quick       one recorded case and one graph of them
  tools/reproduce --gyro --seeds 4          what a gyro brings, and what a wrong one costs
  tools/reproduce --gyro gyro               the row of a gyro that is right, 25 minutes
  tools/reproduce --efficiency --seeds 3    how near to the best that there is, an hour
  tools/reproduce --first-pose --seeds 500  how soon robots of the demo say where they are
  tools/reproduce --calibrate               the noise for which odometry is as wrong as the paper's

The folder gets results.md, results.json (with the verdict) and pictures.
"""
NO_INPUT, BROKEN_OFF = 66, 130


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    options = _parser().parse_args(arguments)
    if options.calibrate:
        model = experiment.calibrated(range(options.seeds))
        print(f"scale = {model.scale:.3f}, yaw_deg_per_m = {model.yaw_deg_per_m:.3f}")
        return 0
    if options.first_pose:
        return first_pose.main(["--seeds", str(options.seeds)])
    if options.rbcd is not None:
        return rbcd(options.rbcd, options.quick)
    if options.gyro is not None:
        return gyro(1 if options.quick else options.seeds, options.gyro)
    if options.efficiency:
        out, write = options.out or Path("out/reproduce-efficiency"), write_efficiency
        pieces = plan.efficient(1, efficiency.TEAMS[:2])
        pieces = pieces if options.quick else plan.efficient(options.seeds)
    else:
        out = options.out or Path("out/reproduce-quick" if options.quick else "out/reproduce")
        pieces, write = plan.quick() if options.quick else plan.full(options.seeds), write_all
    state = State(out / "state.json")
    if state.stale:
        print(f"{out}/state.json was made by other code: starting anew", file=sys.stderr)
    try:
        work(pieces, state)
    except KeyboardInterrupt:
        print(f"\nbroken off; {len(state.done)} pieces are kept in {out}", file=sys.stderr)
        return BROKEN_OFF
    checks = write(state.total([piece.name for piece in pieces]), out)
    print((out / "verdict.md").read_text())
    print(f"everything: {out}/results.md")
    return 0 if all(check.ok for check in checks) else 1


def rbcd(data: Path, quick: bool) -> int:
    """Print how near module 3 comes to the optimum of the same edges; the exit code."""
    reached: list[bool] = []
    for line in rbcd_table.lines(data, quick, lambda what: print(what, file=sys.stderr)):
        if not reached:
            print(rbcd_table.markdown(rbcd_table.HEAD, "reached"))
            print(rbcd_table.markdown(("---",) * len(rbcd_table.HEAD), "---"))
        reached.append(line.is_reached)
        print(rbcd_table.markdown(line.cells, "yes" if line.is_reached else "**no**"), flush=True)
    if not reached:
        return NO_INPUT
    return 0 if all(reached) else 1


def gyro(seeds: int, names: Sequence[str] = ()) -> int:
    """Print what a gyro in every base brings, these rows or all; the exit code."""
    cases = [case for case in gyro_rows.CASES if not names or case.name in names]
    progress = Progress("reproducing", float(seeds * len(cases)))
    totals: dict[str, Tally] = {}
    print(gyro_rows.HEAD)
    reached = []
    for k, case in enumerate(cases):
        total = totals[case.name] = Tally()
        for seed in range(seeds):
            progress(float(k * seeds + seed))
            total.merge(gyro_rows.run(case, seed).sums)
        row, is_reached = gyro_rows.row(case, totals)
        reached.append(is_reached)
        print(row, flush=True)
    progress.end()
    return 0 if all(reached) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/reproduce",
        description="Make the paper's experiment anew; fill its tables, printed and ours.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="one seed, fewer rows")
    parser.add_argument(
        "--seeds", type=whole(1), default=plan.SEEDS, metavar="N", help="default 20"
    )
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="default out/reproduce[-quick]")
    parser.add_argument(
        "--rbcd", type=Path, metavar="DATA", help="hold module 3 against its centralised optimum"
    )
    parser.add_argument(
        "--gyro",
        nargs="*",
        metavar="ROW",
        choices=[case.name for case in gyro_rows.CASES],
        help="the experiment with gyros, 10 minutes a seed; of these rows alone a minute each",
    )
    parser.add_argument(
        "--efficiency", action="store_true", help="how near to the Cramer-Rao bound"
    )
    parser.add_argument(
        "--first-pose", action="store_true", help="time first poses, and count wrong ones"
    )
    parser.add_argument("--calibrate", action="store_true", help="print the noise and end")
    return parser


def work(pieces: list[plan.Piece], state: State) -> None:
    """Do what is not done yet."""
    progress = Progress("reproducing", sum(piece.seconds for piece in pieces))
    done = 0.0
    for piece in pieces:
        progress(done)
        if piece.name not in state.done:
            state.keep(piece.name, piece.run())
        done += piece.seconds
    progress(done)
    progress.end()


def write_all(total: Tally, out: Path) -> list[verdict.Check]:
    """Pages, figures and pictures of everything."""
    checks = verdict.checks(total)
    drawn = pictures.draw(total, out)
    _write(total, checks, pages.everything(total, checks, drawn), out)
    return checks


def write_efficiency(total: Tally, out: Path) -> list[verdict.Check]:
    """How near to the bound."""
    checks = verdict.efficient(total)
    page = pages.efficiency_of(total)
    print(page, end="\n\n")
    _write(total, checks, page + "\n", out)
    return checks


def _write(total: Tally, checks: list[verdict.Check], page: str, out: Path) -> None:
    figures = {"verdict": [check.as_dict() for check in checks], "figures": total.as_dict()}
    texts = {
        "results.json": json.dumps(figures, indent=1) + "\n",
        "verdict.md": pages.verdict(checks),
        "results.md": page,
    }
    for name, text in texts.items():
        if code := keep(out / name, text):
            raise SystemExit(code)


if __name__ == "__main__":
    raise SystemExit(main())
