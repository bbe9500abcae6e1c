"""What the steps of ``drslamd calibrate`` make of what was measured."""

from __future__ import annotations

import math
from argparse import Namespace
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from drslamd.cli.setting_up import calibration_steps
from drslamd.cli.setting_up.calibration_steps import MEASURES, Done
from drslamd.cli.setting_up.measuring import NotMeasured, Seen, Why
from drslamd.config import Config, parse
from drslamd.sensors.samples import RangeSample
from drslamd.setup.calibration_file import Taped
from drslamd.setup.taped_steps import Mistake
from drslamd.setup.way import Phase, Way
from drslamd.slam.graph.estimate import Learned

CONFIG = parse(
    'robot.id = 3\nteam.insecure = true\nuwb.port = "/u"\n'
    'wheels = {source = "kobuki", port = "/w"}\n'
)
OPTIONS = Namespace(metres=1.0, turns=1.0, within=10.0, peer=4, peer_uwb=None)
ARC = math.pi * 0.23


def measured(monkeypatch: pytest.MonkeyPatch, result: Way | NotMeasured) -> None:
    async def way(_: Config, within_s: float, tell: Callable[[Seen], None]) -> Way | NotMeasured:
        assert within_s == 10.0
        for phase in Phase.STANDING, Phase.MOVING, Phase.MOVING, Phase.ENDED:
            tell(Seen(phase, Way(0.5, 0.0, 0.5, 0.23)))
        return result

    monkeypatch.setattr(calibration_steps, "measured_way", way)


def done(step: str, taped: Taped) -> Done:
    result = MEASURES[step](OPTIONS, CONFIG, taped)
    assert isinstance(result, Done), result
    return result


def test_both_steps_fill_one_file_and_say_when_to_go(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    measured(monkeypatch, Way(1.25, 0.0, 1.25, 0.23))
    first = done("push", Taped(3, biases={4: Learned(0.1, 0.1)}))
    assert first.taped.push is not None
    assert first.lines[1].startswith("  ways come out 20.0 % too long, +- 0.4 %")
    said = capsys.readouterr().err.splitlines()
    assert said[1:] == ["  go", "  stands"]
    measured(monkeypatch, Way(0.0, 2 * math.pi / 1.1, 0.0, 0.23))
    both = done("turn", first.taped)
    assert both.lines[1].startswith("  turns are 10.0 % longer than that, +- ")
    assert (both.taped.push, both.taped.biases) == (first.taped.push, {4: Learned(0.1, 0.1)})
    assert both.taped.turn is not None
    assert both.numbers["turn"] == pytest.approx(0.1)


def test_a_fault_and_a_mistake_go_through(monkeypatch: pytest.MonkeyPatch) -> None:
    fault = NotMeasured(Why.TIME, "late")
    for step in ("push", "turn"):
        measured(monkeypatch, fault)
        assert MEASURES[step](OPTIONS, CONFIG, Taped(3)) == fault
        measured(monkeypatch, Way(-1.0, 0.0, -1.0, 0.23))
        assert isinstance(MEASURES[step](OPTIONS, CONFIG, Taped(3)), Mistake)


@pytest.mark.parametrize(("named", "asked"), [(None, 4), (77, 77)])
def test_ranges_are_those_to_the_module_of_the_peer(
    monkeypatch: pytest.MonkeyPatch, named: int | None, asked: int
) -> None:
    def ranges(_: Config, peer: int, seconds: float, tell: Callable[[float], None]) -> Any:
        async def wait() -> list[RangeSample]:
            tell(1.0)
            return [RangeSample(k, peer, 0.9, 3.0) for k in range(50)]

        heard.append(peer)
        result: Awaitable[list[RangeSample]] = wait()
        return result

    heard: list[int] = []
    monkeypatch.setattr(calibration_steps, "measured_ranges", ranges)
    options = Namespace(**{**vars(OPTIONS), "peer_uwb": named})
    result = MEASURES["apart"](options, CONFIG, Taped(3))
    assert isinstance(result, Done)
    assert heard == [asked]
    assert result.lines[1].startswith("  they are 0.100 m too short")
    assert [*result.taped.biases] == [4]
