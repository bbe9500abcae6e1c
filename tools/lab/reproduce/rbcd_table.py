"""The paper's module 3 held against the optimum that a centralised solver finds of the same edges.

Recorded teams are played to the daemon's own robots, live, with and without loss; the graph that
they then hold is optimised once more from nothing, round by round, to see how the cost falls. So
are graphs of which the optimum was certified elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drslamd.conventions import GRID_US
from drslamd.slam.graph import team_frame
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.closures.claimed import edges_of
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from lab.benchmark import graphs
from lab.play import virtual_team
from lab.play.block_team import Descent, SplitGraph, descend
from lab.play.simulator import Network, Simulator
from lab.play.turns import Air
from lab.recordings import pyfg
from lab.recordings.recording import Array, Recording
from lab.reproduce import plan
from lab.reproduce.experiment import TYPICAL_SEED, trial
from lab.score import outcome
from lab.score.outcome import Outcome
from lab.score.outcome import Path as Way

TIERS = "tiers_turtlebots/tiers_4robots_cora.pyfg"
CASES = tuple((tau, epsilon) for tau in (50, 100, 200) for epsilon in (0.1, 0.5))
TEAMS = ("team3_400", "team5_400")
LOSS = 0.3
NEAR, NEARER = 1e-2, 1e-6
"""Relative distances to the optimum that rounds are counted to ..."""
ROUNDS = {0.0: (40, 350), LOSS: (120, None)}
"""... and how many are wanted at most, by loss."""
MOST_ROUNDS = 400
ATE_RATIO = 1.1
RISE = 1e-9
"""Relative; what 32 bits on the air leave of a cost that never rises."""
PRINTED_MB = 4.3


@dataclass(frozen=True)
class Line:
    """One line of the table: what, and its figures in the order of HEAD; is all as wanted?"""

    cells: tuple[str, ...]
    is_reached: bool


HEAD = (
    "graph", "lost", "ATE m", "optimum's m", "ratio", "to 1 %", "to 1e-6", "rise", "at rest", "MB"
)  # fmt: skip


def lines(data: Path, quick: bool, said: Callable[[str], None] = lambda _: None) -> Iterator[Line]:
    """The whole table; what is not there is named.

    Args:
        data: folder of the recordings' folders.
        quick: one case, one graph; under a minute and a half.
        said: told what is done next.
    """
    if (data / TIERS).exists():
        recording = pyfg.read(data / TIERS)
        for tau, epsilon in CASES[1:2] if quick else CASES:
            for loss in ROUNDS:
                said(f"TIERS, tau {tau}, epsilon {epsilon}, {loss:.0%} lost")
                yield recorded(recording, tau, epsilon, loss)
    else:
        said(f"no {data / TIERS}")
    for name in TEAMS[:1] if quick else TEAMS:
        folder = data / "posegraphs"
        if (folder / graphs.GRAPHS[name].file).exists():
            for loss in ROUNDS:
                said(f"{name}, {loss:.0%} lost")
                yield certified(graphs.load(name, folder=folder), loss)
        else:
            said(f"no {folder / graphs.GRAPHS[name].file}")
    if not quick:
        said("the paper's experiment at 1 Hz")
        yield traffic()


def recorded(recording: Recording, tau: int, epsilon: float, loss: float) -> Line:
    """A recording played live, then its graph once more from nothing."""
    extra = (
        f'[relative_pose]\nalgorithm = "paper"\ntau = {tau}\n'
        f'[consistency]\nepsilon = {epsilon}\n[optimizer]\nalgorithm = "rbcd"\n'
    )
    simulator = virtual_team.play(recording, 0, Network(loss=loss), extra)
    found = virtual_team.outcome(simulator)
    graph = held(simulator)
    best = PoseGraphSolver(graph.edges, len(graph.robot)).solve()
    ate = _ate(recording, found)
    central = _ate(recording, _central(simulator, graph, best.poses))
    down = descend(graph, MOST_ROUNDS, Air(loss))
    megabytes = sum(found.bytes_sent.values()) / 1e6
    name = f"TIERS, tau {tau}, epsilon {epsilon}"
    return line(name, loss, down, best.cost, (ate, central), megabytes)


def held(simulator: Simulator) -> SplitGraph:
    """The pose graph that the lowest robot of a team holds."""
    graph = simulator.members[min(simulator.members)].robot.back.graph
    members = max(team_frame.groups(graph), key=len)
    places = factors.numbering(graph, members)
    return SplitGraph(places.robot, places.n, edges_of(graph, places)[0])


def _central(simulator: Simulator, graph: SplitGraph, poses: Array) -> Outcome:
    """What a centralised solver would have said of every path."""
    out = Outcome()
    for robot in np.unique(graph.robot).tolist():
        mine, clock = graph.robot == robot, simulator.members[robot].clock
        t = np.array([clock.world(int(n) * GRID_US) / 1e6 for n in graph.n[mine]])
        out.final[robot] = Way(t, poses[mine], np.zeros(len(t)))
    return out


def _ate(recording: Recording, found: Outcome) -> float:
    team = outcome.score(recording, found)["team"]
    return float(team["ate_rmse_m"]) if team else float("inf")


def certified(graph: graphs.Graph, loss: float) -> Line:
    """A graph from elsewhere, from nothing."""
    of_place = np.argsort(graph.place)
    parts = SplitGraph(graph.robot[of_place], graph.n[of_place], graph.edges)
    down = descend(parts, MOST_ROUNDS, Air(loss))
    return line(graph.name, loss, down, graph.known.optimum, None, down.megabytes)


def line(
    name: str,
    loss: float,
    down: Descent,
    least: float,
    ates: tuple[float, float] | None,
    megabytes: float,
) -> Line:
    """What was reached, and whether that is enough.

    Args:
        least: cost of the optimum.
        ates: of the team and of the optimum, where the truth is known.
    """
    near, nearer = (down.rounds_to(least * (1 + gap)) for gap in (NEAR, NEARER))
    reached = [down.worst_rise() <= RISE, down.at_rest]
    for rounds, most in zip((near, nearer), ROUNDS[loss], strict=True):
        reached.append(most is None or (rounds is not None and rounds <= most))
    ate = ("-", "-", "-")
    if ates is not None:
        ratio = ates[0] / ates[1]
        reached.append(ratio <= ATE_RATIO)
        ate = (f"{ates[0]:.4f}", f"{ates[1]:.4f}", f"{ratio:.3f}")
    end = f"{len(down.costs)}" if down.at_rest else "never"
    rise = f"{down.worst_rise():.0e}" if down.worst_rise() > 0 else "0"
    rounds_to = (f"{near or 'never'}", f"{nearer or 'never'}")
    cells = (name, f"{loss:.0%}", *ate, *rounds_to, rise, end, f"{megabytes:.2f}")
    return Line(cells, all(reached))


def traffic() -> Line:
    """Table IV's daemons with the paper's three algorithms, at 1 Hz."""
    recording = trial(TYPICAL_SEED).recording
    found = virtual_team.run(recording, extra=plan.SYSTEMS["paper/1"])
    megabytes = sum(found.bytes_sent.values()) / 1e6
    blank = ("-",) * (len(HEAD) - 3)
    name = "paper's experiment, 353 s at 1 Hz"
    return Line((name, "0%", *blank, f"{megabytes:.2f}"), megabytes < PRINTED_MB)


def markdown(row: tuple[str, ...], is_reached: str) -> str:
    return f"| {' | '.join((*row, is_reached))} |"
