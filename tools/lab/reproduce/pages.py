"""Tables as Markdown: what the paper prints, its algorithms here, and this system."""

from __future__ import annotations

from collections.abc import Sequence

from lab.reproduce import printed
from lab.reproduce.plan import SYSTEMS
from lab.reproduce.table2 import EPSILONS
from lab.reproduce.table2 import TAUS as PCM_TAUS
from lab.reproduce.tally import Tally
from lab.reproduce.verdict import Check
from lab.reproduce.window_columns import DELTAS, ODOMETRY_NOISE, RANGE_LIMITS, RANGE_NOISE, TAUS

INTRODUCTION = (
    "{seeds} seed(s). Errors are those of the pose of one robot in the frame of another, all "
    "pairs, at each second: mean ± standard deviation. *printed*: what the paper prints; "
    "*paper*: its algorithms as printed, on our data; *drslamd*: the daemons with their default "
    "configuration, on the same data."
)
WAYS = {"nls": "NLS alone", "coarse": "coarse search alone", "both": "coarse search + NLS"}


def everything(total: Tally, checks: Sequence[Check], drawn: Sequence[str]) -> str:
    """The whole page."""
    parts = [
        "# The paper's experiment, made anew",
        INTRODUCTION.format(seeds=total["central/ate"].n),
        "## Was it reached?", verdict(checks),
        "## Table I: one window", table1(total),
        "## Table II: consistency and optimisation", table2(total),
        "## Table III: against what else there is", table3(total),
        "## Table IV: time and messages", table4(total),
        "## The search step", deltas(total),
        "## Range limit and range noise", ranges(total),
        "## Odometry noise", odometry(total),
        "## Honesty", honesty(total),
        "## Pictures", "\n\n".join(f"![{name}]({name})" for name in drawn),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def verdict(checks: Sequence[Check]) -> str:
    missed = [check for check in checks if not check.ok]
    said = f"{len(checks) - len(missed)} of {len(checks)} reached."
    rows = [
        ("yes" if c.ok else "**no**", c.name, "-" if c.reached is None else f"{c.reached:.3g}",
         c.wanted)
        for c in (*missed, *(c for c in checks if c.ok))
    ]  # fmt: skip
    return said + "\n\n" + table(["reached", "what", "value", "wanted"], rows) + "\n"


def _ms(total: Tally, name: str) -> str:
    return f"{total[name].mean:.1f}" if name in total else "-"


def _share(total: Tally, name: str) -> str:
    return f"{100 * total[name].mean:.1f} %" if name in total else "-"


def table1(total: Tally) -> str:
    """Errors and times of single windows."""
    rows: list[list[object]] = []
    for tau in TAUS:
        for way, words in WAYS.items():
            m, deg, ms = printed.TABLE_1[tau][way]
            name = f"table1/{tau}/{way}"
            here = (total[f"{name}/m"], total[f"{name}/deg"], _ms(total, f"{name}/ms"))
            rows.append([tau, words, m, deg, ms, *here, ""])
        name = f"table1/{tau}/drslamd"
        one, many = _share(total, f"{name}/unique"), _share(total, f"{name}/ambiguous")
        here = (total[f"{name}/m"], total[f"{name}/deg"], _ms(total, f"{name}/ms"))
        rows.append([tau, "drslamd, same window", "", "", "", *here, f"{one}, {many}"])
    name = "drslamd/before"
    own = (total[f"{name}/m"], total[f"{name}/deg"], _ms(total, "drslamd/ms/relative_pose"))
    rows.append(["own", "drslamd, its own window", "", "", "", *own, ""])
    head = ["tau", "way", "printed m", "printed °", "printed ms", "m", "°", "ms",
            "one answer, several"]  # fmt: skip
    note = "drslamd is scored where it names one pose; otherwise it says that it does not know."
    return table(head, rows) + "\n\n" + note


def table2(total: Tally) -> str:
    """Inliers and errors before and after DPGO."""
    rows: list[list[object]] = []
    ours = [total["drslamd/after/m"], total["drslamd/after/deg"]]
    for tau in PCM_TAUS:
        for epsilon in EPSILONS:
            name = f"table2/{tau}/{epsilon}"
            if f"{name}/after/m" not in total:
                continue
            n, m0, deg0, m1, deg1 = printed.TABLE_2[tau, epsilon]
            before, there, after = (
                [total[f"{name}/{when}/{unit}"] for unit in ("m", "deg")]
                for when in ("before", "there", "after")
            )
            rows.append([
                tau, "no PCM" if epsilon is None else epsilon, n, f"{m0}, {deg0}", f"{m1}, {deg1}",
                f"{total[f'{name}/inliers'].mean:.0f}", *before, *there, *after,
                f"{total[f'{name}/ate'].mean:.2f}", *ours,
            ])  # fmt: skip
    head = ["tau", "epsilon", "printed inliers", "printed before", "printed after",
            "paper inliers", "before m", "before °", "there m", "there °", "after m", "after °",
            "joint ATE m", "drslamd m", "drslamd °"]  # fmt: skip
    kept, seen = total["drslamd/kept/m"], total["drslamd/before/m"]
    note = (
        "Before optimisation there is a pose only where a closure was kept; *there* is after it at "
        "the same times. drslamd does not depend on tau: one run per seed. "
        f"Before optimisation {seen} m, "
        f"{total['drslamd/before/deg']}° (windows with one answer), of those kept {kept} m, "
        f"{total['drslamd/kept/deg']}°; after it {ours[0]} m, {ours[1]}°; "
        f"joint ATE {total['drslamd/ate'].mean:.3f} m; "
        f"{_share(total, 'drslamd/localised')} of poses localised in one frame."
    )
    return table(head, rows) + "\n\n" + note


def table3(total: Tally) -> str:
    """Odometry, both systems, and a centralised one that is told the start."""
    best = "table2/50/0.5/after"
    rows = [
        ["odometry, true start given", "0.85 ± 0.52", "8.99 ± 5.80", total["odometry/m"],
         total["odometry/deg"], "-"],
        ["paper (tau 50, epsilon 0.5)", "0.45 ± 0.30", "4.01 ± 2.81", total[f"{best}/m"],
         total[f"{best}/deg"], f"{total['table2/50/0.5/ate'].mean:.2f}"],
        ["centralised UWB SLAM, true start given", "0.71 ± 0.52", "6.76 ± 4.79",
         total["central/m"], total["central/deg"], f"{total['central/ate'].mean:.2f}"],
        ["drslamd", "", "", total["drslamd/after/m"], total["drslamd/after/deg"],
         f"{total['drslamd/ate'].mean:.3f}"],
    ]  # fmt: skip
    head = ["", "printed m", "printed °", "m", "°", "joint ATE m"]
    return table(head, rows)


def table4(total: Tally) -> str:
    """Time per module and bytes of the team."""
    rows: list[list[object]] = [
        ["printed", "", *printed.TABLE_4_MS.values(),
         ", ".join(f"{mb} MB at {hz} Hz" for hz, mb in printed.TABLE_4_MB.items())],
        ["paper, offline, tau 50", "", *(_ms(total, f"paper/ms/50/{m}") for m in ("pose", "pcm")),
         _ms(total, "paper/ms/50/dpgo"), ""],
    ]  # fmt: skip
    for name in SYSTEMS:
        column, rate = name.split("/")
        at = f"table4/{name}"
        times = [_ms(total, f"{at}/ms/{module}")
                 for module in ("relative_pose", "consistency", "optimizer")]  # fmt: skip
        mb = f"{total[f'{at}/bytes'].mean / 1e6:.2f} MB" if f"{at}/bytes" in total else "-"
        rows.append([f"{column}, three daemons", f"{rate} Hz", *times, mb])
    note = (
        "Milliseconds for one pair (1, 2) or one robot (3); printed are all three robots together. "
        "Megabytes are what all three send in the whole experiment."
    )
    return table(["", "DPGO at", "1 pose", "2 PCM", "3 DPGO", "sent"], rows) + "\n\n" + note


def deltas(total: Tally) -> str:
    rows = []
    for delta in DELTAS:
        cells: list[object] = [delta]
        for way in ("coarse", "paper", "drslamd"):
            name = f"sweep/delta/{delta}/{way}"
            cells += [total[f"{name}/m"], total[f"{name}/deg"], _ms(total, f"{name}/ms")]
        rows.append(cells)
    head = ["delta", "coarse m", "°", "ms", "coarse + NLS m", "°", "ms", "drslamd m", "°", "ms"]
    return table(head, rows)


def ranges(total: Tally) -> str:
    rows = [
        [f"{limit:.0%}", sigma, *_pair_of_columns(total, f"sweep/range/{limit}/{sigma}")]
        for limit in RANGE_LIMITS
        for sigma in RANGE_NOISE
    ]
    return table(["limit", "noise added, m", *COLUMNS], rows)


def odometry(total: Tally) -> str:
    rows = [
        [f"{m} m, {deg}°", *_pair_of_columns(total, f"sweep/odometry/{m}")]
        for m, deg in ODOMETRY_NOISE
    ]
    return table(["noise added", *COLUMNS], rows)


COLUMNS = ("paper m", "paper °", "windows", "drslamd m", "drslamd °", "one answer")


def _pair_of_columns(total: Tally, name: str) -> list[object]:
    paper, ours = f"{name}/paper", f"{name}/drslamd"
    return [
        total[f"{paper}/m"], total[f"{paper}/deg"], total[f"{paper}/answered"].n,
        total[f"{ours}/m"], total[f"{ours}/deg"], _share(total, f"{ours}/answered"),
    ]  # fmt: skip


def honesty(total: Tally) -> str:
    """Claimed covariances against true errors."""
    names = {f"tau {tau}": f"table1/{tau}/drslamd/claim" for tau in TAUS}
    names["the daemon's windows"] = "drslamd/claim"
    rows: list[list[object]] = []
    for words, name in names.items():
        if f"{name}/nees" in total:
            rows.append([
                f"closures, {words}", total[f"{name}/nees"].n, f"{total[f'{name}/nees'].mean:.2f}",
                f"{_share(total, f'{name}/below')} <= 14.2", _share(total, f"{name}/wild"),
            ])  # fmt: skip
        else:
            rows.append([f"closures, {words}", 0, "-", "-", "-"])
    name = "drslamd/published"
    rows.append(["published poses", total[f"{name}/nees"].n, f"{total[f'{name}/nees'].mean:.2f}",
                 f"{_share(total, f'{name}/inside')} in the 95 % ellipse", "-"])  # fmt: skip
    return table(["", "n", "NEES per degree of freedom", "within", "beyond 50"], rows)
