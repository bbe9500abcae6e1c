"""Harm in computers: clocks, disks, processes, and a copy of a whole robot."""

from __future__ import annotations

from lab.play.simulator import Clock
from lab.soak.stage import Act, Bench, Put, Stage


def drift(stage: Stage, ppm: float) -> None:
    for k, robot in enumerate(stage.robots):
        offset = stage.clocks[robot].offset_us
        stage.clocks[robot] = Clock(offset, ppm * (-1) ** k)


def suspended(stage: Stage, seconds: float) -> None:
    robot = stage.one()
    stage.at(stage.begin_s, lambda bench: bench.sleep(bench.members[robot], seconds))


def stalled(stage: Stage, seconds: float) -> None:
    robot = stage.one()

    def act(bench: Bench) -> None:
        bench.members[robot].stalled_until = bench.now + round(seconds * 1e6)

    stage.at(stage.begin_s, act)


def disk(fault: str) -> Put:
    def put(stage: Stage, _: float) -> None:
        robot = stage.one()

        def set_fault(what: str) -> Act:
            return lambda bench: setattr(bench.disk(robot), "fault", what)

        stage.at(stage.begin_s, set_fault(fault))
        stage.at(stage.end_s, set_fault(""))

    return put


def restarts(stage: Stage, times: float) -> None:
    """A robot loses its power and comes back two seconds later, so often."""
    robot = stage.one()
    apart = (stage.end_s - stage.begin_s) / times
    for k in range(int(times)):
        at_s = stage.begin_s + k * apart
        stage.at(at_s, lambda bench: bench.kill(bench.members[robot]))
        stage.at(at_s + 2.0, lambda bench: bench.switch_on(robot))


def wiped(stage: Stage, _: float) -> None:
    """A robot restarts with an empty disk."""
    robot = stage.one()

    def kill(bench: Bench) -> None:
        bench.kill(bench.members[robot])
        bench.disk(robot).state = {}

    stage.at(stage.begin_s, kill)
    stage.at(stage.begin_s + 2.0, lambda bench: bench.switch_on(robot))


def doubled(stage: Stage, later_s: float) -> None:
    """Another robot begins with the card of this one, and goes when everything is whole again."""
    robot = stage.one()
    stage.at(stage.begin_s + later_s, lambda bench: bench.double(robot))
    stage.at(stage.end_s, lambda bench: bench.kill(bench.doubles[robot]))


def left(stage: Stage, _: float) -> None:
    """A robot leaves in order and comes back."""
    robot = stage.one()
    stage.at(stage.begin_s, lambda bench: bench.stop(bench.members[robot]))
    stage.at(stage.end_s, lambda bench: bench.switch_on(robot))
