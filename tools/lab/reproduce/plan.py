"""The work, in pieces that can be done one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from lab.bound import efficiency
from lab.play import virtual_team
from lab.reproduce import central, table2, team_column, window_columns
from lab.reproduce.experiment import PAIRS, TYPICAL_SEED, pose_errors, trial
from lab.reproduce.tally import Tally
from lab.score import metrics

SEEDS = 20
SWEEP_SEEDS = 4
RBCD = '[relative_pose]\nalgorithm = "paper"\n[optimizer]\nalgorithm = "rbcd"\n'
SYSTEMS = {
    "paper/1": RBCD + "rate_hz = 1\n",
    "paper/10": RBCD + "rate_hz = 10\n",
    "drslamd/1": "[optimizer]\nrate_hz = 1\n",
    "drslamd/10": "[optimizer]\nrate_hz = 10\n",
}
"""Table IV: what the robots are told, by column and rate of DPGO in Hz."""


@dataclass(frozen=True)
class Piece:
    """Some work under a name; `seconds` are of one core, for the progress bar."""

    name: str
    seconds: float
    run: Callable[[], Tally]


def quick() -> list[Piece]:
    """One seed, the rows that the text of the paper speaks of: under three minutes."""
    seed, data = TYPICAL_SEED, partial(trial, TYPICAL_SEED)
    return [
        Piece("quick table2", 25, lambda: table2.fill(data(), (10, 50), (None, 0.1, 0.5))),
        Piece("quick central", 1, partial(_central, seed)),
        Piece("quick team", 35, partial(_team, seed)),
        Piece("quick table1", 15, lambda: window_columns.table1(data(), 30, 6)),
        Piece("quick sweeps", 15, lambda: window_columns.sweeps(data(), 60)),
    ]


def full(seeds: int) -> list[Piece]:
    """Everything, seed by seed; a seed has so many windows that some of them do for table I."""
    pieces = []
    for seed in range(seeds):
        pieces += [
            Piece(f"table1/{seed}", 16, partial(_table1, seed)),
            Piece(f"table2/{seed}", 65, partial(_table2, seed)),
            Piece(f"central/{seed}", 1, partial(_central, seed)),
            Piece(f"team/{seed}", 33, partial(_team, seed)),
        ]
    pieces += [
        Piece(f"sweeps/{s}", 60, partial(_sweeps, s)) for s in range(min(SWEEP_SEEDS, seeds))
    ]
    # the column drslamd has the first team
    pieces += efficient(seeds, efficiency.TEAMS[1:])
    pieces += [Piece(f"table4/{name}", 90, partial(_system, name)) for name in SYSTEMS]
    return pieces


def efficient(seeds: int, teams: Sequence[efficiency.Team] = efficiency.TEAMS) -> list[Piece]:
    """How near to the bound, all teams seed by seed."""
    return [
        Piece(f"{team.name}/{seed}", team.seconds, partial(efficiency.run, team, seed))
        for seed in range(seeds)
        for team in teams
    ]


def _table1(seed: int) -> Tally:
    return window_columns.table1(trial(seed), 18, 3)


def _table2(seed: int) -> Tally:
    return table2.fill(trial(seed), table2.TAUS, table2.EPSILONS)


def _team(seed: int) -> Tally:
    return team_column.run(trial(seed))


def _sweeps(seed: int) -> Tally:
    return window_columns.sweeps(trial(seed), 40)


def _central(seed: int) -> Tally:
    """Table III's rival."""
    tally, data = Tally(), trial(seed)
    poses = central.solve(data)
    for a, b in PAIRS:
        found = metrics.relative(poses[a], poses[b])
        tally.poses("central", pose_errors(found, data.true_pairs(a, b)))
    robots = sorted(poses)
    ate = table2.joint_ate([poses[r] for r in robots], [data.truth[r] for r in robots])
    tally.add("central/ate", ate)
    return tally


def _system(name: str) -> Tally:
    """Table IV: time per module and bytes of three robots over the whole experiment."""
    result = virtual_team.run(trial(TYPICAL_SEED).recording, extra=SYSTEMS[name])
    tally = Tally()
    tally.add(f"table4/{name}/bytes", float(sum(result.bytes_sent.values())))
    for module, ms in result.ms.items():
        tally.add(f"table4/{name}/ms/{module}", ms)
    return tally
