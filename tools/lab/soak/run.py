"""One run: a team drives, things go wrong, are whole again, and a minute later all is well."""

from __future__ import annotations

import re
import subprocess
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drslamd.gossip.message_types import PoseState
from lab.recordings import world
from lab.soak import agreement
from lab.soak.faults import FAULTS
from lab.soak.invariants import Broken, Invariants
from lab.soak.scenarios import Scenario, scenario_of
from lab.soak.stage import Bench, Stage
from lab.trust import watch
from lab.trust.watch import LOCALISED

BEGIN_S = 35.0
"""The team knows where everybody is by then."""
HEAL_S = 60.0
"""After the faults, in which everything has to be well again."""
RATES = "[relative_pose]\nrate_hz = 0.5\n[optimizer]\nrate_hz = 0.5\n"
"""Keys of every robot: half as often as by default, for twice as many runs in an hour."""
STEADY_S = 10.0
WELL_FOR = 3
"""Seconds in a row."""
SCENE = world.Scene(
    robots=3,
    ranges=world.RangeModel(bias=0.05, slow=0.03, burst_share=0.0),
    odometry=world.OdometryModel(scale=0.01, yaw_deg_per_m=0.05),
    odometry_hz=20,
    range_hz=5,
    both_measure=False,
)
"""The matrix' nominal team: wheels at 20 Hz, ranges of a pair at 5 Hz, mild noise."""


@dataclass
class Figures:
    """What came of a run.

    Attributes:
        healed_s: from the end of the faults until all graphs are equal and everybody has a pose.
        liars: seconds of robots that were over a metre off and claimed a third of one.
        peak_x: the most bytes in a second after the faults, by the mean before them.
        refused: datagrams by reason, of all robots.
    """

    healed_s: float = float("inf")
    liars: int = 0
    peak_x: float = 0.0
    refused: dict[str, int] = field(default_factory=dict)


@dataclass
class Result:
    """A run and how it ended.

    Attributes:
        digest: of all bytes that were sent.
        fault: what was not kept, empty when everything was.
        until_s: when that was seen.
    """

    scenario: Scenario
    seed: int
    figures: Figures
    digest: str = ""
    fault: str = ""
    until_s: float = 0.0

    @property
    def line(self) -> str:
        """One line that says how it ended, and the command that repeats it."""
        name, seed = self.scenario.name, self.seed
        if not self.fault:
            return f"ok   {name} seed={seed} healed={self.figures.healed_s:.0f}s {self.digest}"
        return (
            f"FAIL {name} seed={seed} commit={commit()} t={self.until_s:.3f} {self.fault}"
            f" [{self.scenario.what}]\n"
            f"  repeat: tools/soak {name} --seed {seed} --until {self.until_s + 0.001:.3f}"
        )

    def as_json(self) -> dict[str, Any]:
        faults = [list(fault) for fault in self.scenario.faults]
        figures = {k: None if v == float("inf") else v for k, v in asdict(self.figures).items()}
        return {
            "scenario": self.scenario.name,
            "seed": self.seed,
            "commit": commit(),
            "faults": faults,
            "figures": figures,
            "digest": self.digest,
            "fault": self.fault,
            "until_s": self.until_s,
        }


def commit() -> str:
    """What is checked out, `?` outside a repository."""
    here = Path(__file__).parent
    command = ["git", "-C", str(here), "rev-parse", "--short", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "?"


def run(name: str, seed: int, until_s: float = float("inf"), journal: bool = True) -> Result:
    """Play a scenario; the same seed sends the same bytes.

    Args:
        journal: also hold every robot's answers against those of a fresh one (P7).

    Raises:
        KeyError: there is no scenario of this name.
    """
    scenario = scenario_of(name, seed)
    end_s = BEGIN_S + scenario.lasts_s
    scene = world.Scene(**{**SCENE.__dict__, "seconds": end_s + HEAL_S + WELL_FOR})
    stage = Stage(world.simulate(scene, seed), np.random.default_rng([seed, 3]), BEGIN_S, end_s)
    for fault, dose in scenario.faults:
        FAULTS[fault].put(stage, dose)
    result = Result(scenario, seed, Figures())
    bench = Bench(stage, seed, RATES)
    invariants = Invariants(bench, journal)
    try:
        _play(bench, invariants, result, min(until_s, end_s + HEAL_S))
        if until_s == float("inf"):
            invariants.end()
    except Broken as broken:
        result.fault = str(broken)
    except Exception as error:  # P1: whatever it is, it would have ended a robot
        result.fault = f"P1: {type(error).__name__}: {error}"
    result.until_s, result.digest = bench.now / 1e6, invariants.digest
    return result


def _play(bench: Bench, invariants: Invariants, result: Result, until_s: float) -> None:
    stage, figures = bench.stage, result.figures
    seen = watch.Run()
    well, second = 0, 0.0
    while second < until_s and well < WELL_FOR:
        second = min(second + 1, until_s)
        bench.run(second)
        watch.look(seen, stage.recording, bench)
        invariants.look()
        is_over = second >= stage.end_s
        well = well + 1 if is_over and is_well(bench) else 0
    if well == WELL_FOR:
        figures.healed_s = second - WELL_FOR + 1 - stage.end_s
    figures.liars = sum(s.claim.is_lie for s in seen.poses if s.called == LOCALISED)
    figures.peak_x = _peak(list(invariants.bytes_sent), stage)
    for member in bench.members.values():
        for reason, count in member.robot.team.refused.items():
            figures.refused[reason] = figures.refused.get(reason, 0) + count
    if until_s >= stage.end_s + HEAL_S:
        result.fault = _disappointed(result, seen, stage)


def _disappointed(result: Result, seen: watch.Run, stage: Stage) -> str:
    """What was expected and is not."""
    scenario, figures = result.scenario, result.figures
    if figures.healed_s > HEAL_S:
        return f"not well {HEAL_S:.0f} s after the faults"
    for expected in scenario.expects:
        reached = getattr(figures, expected.figure)
        if reached > expected.most:
            return f"{expected.figure} is {reached:g}, not at most {expected.most:g}"
    told = [s.sentence for s in seen.said if stage.begin_s <= s.t]
    if scenario.says and not any(re.search(scenario.says, sentence) for sentence in told):
        return f"nobody says {scenario.says!r}"
    return ""


def _peak(sent: list[int], stage: Stage) -> float:
    begin, end = int(stage.begin_s), int(stage.end_s)
    steady = np.mean(sent[begin - int(STEADY_S) : begin])
    return float(max(sent[end:], default=0) / steady) if steady else 0.0


def is_well(bench: Bench) -> bool:
    """Has everybody the same graph and a pose of now, in one frame?"""
    members = [member for member in bench.members.values() if member.running]
    estimates = [member.robot.back.estimate for member in members]
    frames = {estimate.frame for estimate in estimates if estimate is not None}
    if len(frames) != 1 or None in estimates or len(members) < len(bench.hardware):
        return False
    states = {member.robot.whereabouts(member.clock.local(bench.now)).state for member in members}
    is_placed = not states & {PoseState.NOT_LOCALISED, PoseState.STALE, PoseState.POSITION}
    return is_placed and agreement.is_everywhere(members, bench.now)
