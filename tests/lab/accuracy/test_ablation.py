"""Doing without one piece, and having it back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.accuracy.__main__ import NO_INPUT, main
from lab.accuracy.ablation import PIECES, without

from drslamd.config import parse
from drslamd.slam.optimizer.banded.normal_equations import System
from drslamd.slam.relative_pose import pair_window
from drslamd.slam.relative_pose.window_noise import near_bias

ROBOT = """
[robot]
id = 1
[team]
insecure = true
[uwb]
port = "x"
[wheels]
source = "kobuki"
port = "y"
"""


@pytest.mark.parametrize("name", list(PIECES))
def test_each_piece_changes_something_and_is_back_afterwards(name: str) -> None:
    piece = PIECES[name]
    assert piece.toml or piece.exchanged
    assert (parse(ROBOT + piece.toml) != parse(ROBOT)) == bool(piece.toml)
    before = [getattr(owner, key) for owner, key, _ in piece.exchanged]
    with without(piece):
        now = [getattr(owner, key) for owner, key, _ in piece.exchanged]
        assert all(a is not b for a, b in zip(before, now, strict=True))
    assert [getattr(owner, key) for owner, key, _ in piece.exchanged] == before


def test_what_is_exchanged_is_what_is_read() -> None:
    with without(PIECES["short-range-doubt"]):
        assert near_bias(0.5) == 0.0
    assert near_bias(0.5) > 0.1
    with without(PIECES["closure-dating"]):
        assert pair_window.CONFIRM_US == 0


def test_gauss_holds_the_far_away_as_tightly_as_the_near() -> None:
    def pull(error: float) -> float:
        system = System(np.zeros((1, 0)), np.zeros((0, 1)), np.zeros((1, 1)), np.zeros(1), 0.0)
        system.add_cauchy_prior(np.array([0]), np.array([error]), np.array([0.1]))
        return float(system.gradient[0] / error)

    assert pull(1.0) < 0.02 * pull(0.01)
    with without(PIECES["cauchy-priors"]):
        assert pull(1.0) == pytest.approx(pull(0.01)) == pytest.approx(100.0)


def test_a_failure_puts_everything_back() -> None:
    before = pair_window.CONFIRM_US
    with pytest.raises(RuntimeError), without(PIECES["closure-dating"]):
        raise RuntimeError
    assert before == pair_window.CONFIRM_US


def test_a_section_in_both_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "other.toml"
    config.write_text("[relative_pose]\ndelta = 0.2\n")
    with pytest.raises(SystemExit) as end:
        main([str(tmp_path), "--without", "nlos", "--config", str(config)])
    assert end.value.code == 2
    assert "[relative_pose]" in capsys.readouterr().err
    assert main([str(tmp_path), "--without", "cauchy-priors"]) == NO_INPUT
