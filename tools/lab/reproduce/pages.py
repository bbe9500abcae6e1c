"""Tables as Markdown: what the paper prints, its algorithms here, and this system."""

from __future__ import annotations

from collections.abc import Sequence

from lab.bound import efficiency
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
        "## Was it reached?",
        verdict(checks),
        "## Table I: one window",
        table1(total),
        "## Table II: consistency and optimisation",
        table2(total),
        "## Table III: against what else there is",
        table3(total),
        "## Table IV: time and messages",
        table4(total),
        "## The search step",
        deltas(total),
        "## Range limit and range noise",
        ranges(total),
        "## Odometry noise",
        odometry(total),
        "## Honesty",
        honesty(total),
        "## Efficiency",
        efficiency_of(total),
        "## Pictures",
        "\n\n".join(f"![{name}]({name})" for name in drawn),
    ]
    return "\n\n".join(parts) + "\n"


def table(head: str, rows: Sequence[Sequence[object]]) -> str:
    """A table; the head is its first line as it is written there."""
    lines = [" | ".join(str(cell) for cell in row) for row in rows]
    rule = " | ".join(["---"] * (head.count(" | ") + 1))
    return "\n".join(f"| {line} |" for line in (head, rule, *lines))


def verdict(checks: Sequence[Check]) -> str:
    missed = [check for check in checks if not check.ok]
    said = f"{len(checks) - len(missed)} of {len(checks)} reached."
    rows = []
    for c in (*missed, *(c for c in checks if c.ok)):
        reached = "-" if c.reached is None else f"{c.reached:.3g}"
        rows.append(("yes" if c.ok else "**no**", c.name, reached, c.wanted))
    return said + "\n\n" + table("reached | what | value | wanted", rows) + "\n"


def _ms(total: Tally, name: str) -> str:
    return f"{total[name].mean:.1f}" if name in total else "-"


def _errors(total: Tally, name: str) -> tuple[object, object]:
    """Metres and degrees."""
    return total[f"{name}/m"], total[f"{name}/deg"]


def _ate(total: Tally, name: str, digits: int = 2) -> str:
    return f"{total[f'{name}/ate'].mean:.{digits}f}"


def _share(total: Tally, name: str) -> str:
    return f"{100 * total[name].mean:.1f} %" if name in total else "-"


def table1(total: Tally) -> str:
    """Errors and times of single windows."""
    rows: list[list[object]] = []
    for tau in TAUS:
        for way, words in WAYS.items():
            m, deg, ms = printed.TABLE_1[tau][way]
            name = f"table1/{tau}/{way}"
            here = (*_errors(total, name), _ms(total, f"{name}/ms"))
            rows.append([tau, words, m, deg, ms, *here, ""])
        name = f"table1/{tau}/drslamd"
        one, many = _share(total, f"{name}/unique"), _share(total, f"{name}/ambiguous")
        here = (*_errors(total, name), _ms(total, f"{name}/ms"))
        rows.append([tau, "drslamd, same window", "", "", "", *here, f"{one}, {many}"])
    own = (*_errors(total, "drslamd/before"), _ms(total, "drslamd/ms/relative_pose"))
    rows.append(["own", "drslamd, its own window", "", "", "", *own, ""])
    head = "tau | way | printed m | printed ° | printed ms | m | ° | ms | one answer, several"
    note = "drslamd is scored where it names one pose; otherwise it says that it does not know."
    return table(head, rows) + "\n\n" + note


def table2(total: Tally) -> str:
    """Inliers and errors before and after DPGO."""
    rows: list[list[object]] = []
    ours = _errors(total, "drslamd/after")
    for tau in PCM_TAUS:
        for epsilon in EPSILONS:
            name = f"table2/{tau}/{epsilon}"
            if f"{name}/after/m" not in total:
                continue
            n, m0, deg0, m1, deg1 = printed.TABLE_2[tau, epsilon]
            by_paper = [n, f"{m0}, {deg0}", f"{m1}, {deg1}"]
            here: list[object] = [f"{total[f'{name}/inliers'].mean:.0f}"]
            for when in ("before", "there", "after"):
                here += _errors(total, f"{name}/{when}")
            gate = "no PCM" if epsilon is None else epsilon
            ates = [_ate(total, name), _ate(total, f"{name}/least")]
            rounds = f"{total[f'{name}/rounds'].mean:.0f}"
            rows.append([tau, gate, *by_paper, *here, *ates, rounds, *ours])
    head = (
        "tau | epsilon | printed inliers | printed before | printed after | paper inliers "
        "| before m | before ° | there m | there ° | after m | after ° | joint ATE m "
        "| minimum's m | rounds | drslamd m | drslamd °"
    )
    kept, seen = total["drslamd/kept/m"], total["drslamd/before/m"]
    note = (
        "Before optimisation there is a pose only where a closure was kept; *there* is after it at "
        "the same times. DPGO is run as the daemon runs it; *rounds* is until its cost is within "
        "1 % of the minimum that a centralised solver finds. drslamd does not depend on tau: one "
        "run per seed. "
        f"Before optimisation {seen} m, "
        f"{total['drslamd/before/deg']}° (windows with one answer), of those kept {kept} m, "
        f"{total['drslamd/kept/deg']}°; after it {ours[0]} m, {ours[1]}°; "
        f"joint ATE {total['drslamd/ate'].mean:.3f} m; "
        f"{_share(total, 'drslamd/localised')} of poses localised in one frame."
    )
    return table(head, rows) + "\n\n" + note


def table3(total: Tally) -> str:
    """Odometry, both systems, and a centralised one that is told the start."""
    best = "table2/50/0.5"
    words = {
        "odometry": "odometry, true start given",
        "paper": "paper (tau 50, epsilon 0.5)",
        "central": "centralised UWB SLAM, true start given",
    }
    here = {
        "odometry": (*_errors(total, "odometry"), "-"),
        "paper": (*_errors(total, f"{best}/after"), _ate(total, best)),
        "central": (*_errors(total, "central"), _ate(total, "central")),
    }
    rows: list[list[object]] = []
    for name, figures in printed.TABLE_3.items():
        both = (f"{mean:.2f} ± {spread:.2f}" for mean, spread in figures)
        rows.append([words[name], *both, *here[name]])
    ours = (*_errors(total, "drslamd/after"), _ate(total, "drslamd", 3))
    rows.append(["drslamd", "", "", *ours])
    return table(" | printed m | printed ° | m | ° | joint ATE m", rows)


def table4(total: Tally) -> str:
    """Time per module and bytes of the team."""
    sent = ", ".join(f"{mb} MB at {hz} Hz" for hz, mb in printed.TABLE_4_MB.items())
    offline = (_ms(total, f"paper/ms/50/{module}") for module in printed.TABLE_4_MS)
    rows: list[list[object]] = [
        ["printed", "", *printed.TABLE_4_MS.values(), sent],
        ["paper, offline, tau 50", "", *offline, ""],
    ]
    for name in SYSTEMS:
        column, rate = name.split("/")
        at = f"table4/{name}"
        modules = ("relative_pose", "consistency", "optimizer")
        times = [_ms(total, f"{at}/ms/{module}") for module in modules]
        mb = f"{total[f'{at}/bytes'].mean / 1e6:.2f} MB" if f"{at}/bytes" in total else "-"
        rows.append([f"{column}, three daemons", f"{rate} Hz", *times, mb])
    note = (
        "Milliseconds for one pair (1, 2) or one robot (3); printed are all three robots together. "
        "Megabytes are what all three send in the whole experiment."
    )
    return table(" | DPGO at | 1 pose | 2 PCM | 3 DPGO | sent", rows) + "\n\n" + note


def deltas(total: Tally) -> str:
    rows = []
    for delta in DELTAS:
        cells: list[object] = [delta]
        for way in ("coarse", "paper", "drslamd"):
            name = f"sweep/delta/{delta}/{way}"
            cells += [*_errors(total, name), _ms(total, f"{name}/ms")]
        rows.append(cells)
    head = "delta | coarse m | ° | ms | coarse + NLS m | ° | ms | drslamd m | ° | ms"
    return table(head, rows)


def ranges(total: Tally) -> str:
    rows = [
        [f"{limit:.0%}", sigma, *_pair_of_columns(total, f"sweep/range/{limit}/{sigma}")]
        for limit in RANGE_LIMITS
        for sigma in RANGE_NOISE
    ]
    return table(f"limit | noise added, m | {COLUMNS}", rows)


def odometry(total: Tally) -> str:
    rows = [
        [f"{m} m, {deg}°", *_pair_of_columns(total, f"sweep/odometry/{m}")]
        for m, deg in ODOMETRY_NOISE
    ]
    return table(f"noise added | {COLUMNS}", rows)


COLUMNS = "paper m | paper ° | windows | drslamd m | drslamd ° | one answer"


def _pair_of_columns(total: Tally, name: str) -> list[object]:
    paper, ours = f"{name}/paper", f"{name}/drslamd"
    answered, named = total[f"{paper}/answered"].n, _share(total, f"{ours}/answered")
    return [*_errors(total, paper), answered, *_errors(total, ours), named]


def honesty(total: Tally) -> str:
    """Claimed covariances against true errors."""
    names = {f"tau {tau}": f"table1/{tau}/drslamd/claim" for tau in TAUS}
    names["the daemon's windows"] = "drslamd/claim"
    rows: list[list[object]] = []
    for words, name in names.items():
        if f"{name}/nees" in total:
            within = f"{_share(total, f'{name}/below')} <= 14.2"
            wild = _share(total, f"{name}/wild")
            rows.append([f"closures, {words}", *_nees(total, name), within, wild])
        else:
            rows.append([f"closures, {words}", 0, "-", "-", "-"])
    name = "drslamd/published"
    inside = f"{_share(total, f'{name}/inside')} in the 95 % ellipse"
    rows.append(["published poses", *_nees(total, name), inside, "-"])
    return table(" | n | NEES per degree of freedom | within | beyond 50", rows)


def _nees(total: Tally, name: str) -> tuple[int, str]:
    """How many there were, and their mean."""
    return total[f"{name}/nees"].n, f"{total[f'{name}/nees'].mean:.2f}"


def efficiency_of(total: Tally) -> str:
    """Cramer-Rao bound and our errors, root mean square, and bound over mean square error."""
    rows: list[list[object]] = []
    for team in efficiency.TEAMS:
        for row in efficiency.ROWS:
            cells: list[object] = [team.robots, f"{team.loss:.0%}", row]
            names = [f"{team.name}/{row}/{unit}" for unit in efficiency.UNITS]
            if f"{names[0]}/bound" not in total:
                continue
            cells.append(total[f"{names[0]}/bound"].n)
            for name, digits in zip(names, (3, 2), strict=True):
                known = (total[f"{name}/{what}"].mean for what in ("bound", "told", "square"))
                cells += [f"{value**0.5:.{digits}f}" for value in known]
                cells.append(f"{efficiency.of(total, name):.2f}")
                cells.append(f"{efficiency.on_same_data(total, name):.2f}")
            rows.append(cells)
    head = (
        "robots | loss | what | n | bound m | told all m | ours m | efficiency | same data | "
        "bound ° | told all ° | ours ° | efficiency | same data"
    )
    note = (
        "The bound is what anybody could know who is told every sigma of the simulator and which "
        "ranges are wrong; *told all* is an estimator that is, linear about the truth, on the very "
        "data that we had. In hindsight: relative poses of all pairs; live: each published pose, "
        "in the frame of robot 0; first pose: the first of those of each robot. Efficiency is "
        "bound over mean square error; *same data*: with the mean square error of *told all* in "
        "place of the bound, which is the same in the mean of many seeds, and of few seeds says "
        "more: what the wheels of a seed happen to be is in both errors."
    )
    return table(head, rows) + "\n\n" + note
