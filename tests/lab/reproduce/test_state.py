"""What was computed so far, and when it is believed."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab.reproduce import state
from lab.reproduce.state import State
from lab.reproduce.tally import Tally


def test_a_state_is_taken_up_again(tmp_path: Path) -> None:
    tally = Tally()
    tally.add("x", 2.0)
    State(tmp_path / "state.json").keep("piece", tally)
    again = State(tmp_path / "state.json")
    assert not again.stale
    assert again.total(["piece", "other"])["x"].mean == 2.0


def test_a_state_of_other_code_is_not_believed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    State(tmp_path / "state.json").keep("piece", Tally())
    monkeypatch.setattr(state, "fingerprint", lambda: "other")
    again = State(tmp_path / "state.json")
    assert again.stale
    assert not again.done


@pytest.mark.parametrize("text", ["", "{", "[]", '{"code": 1}'])
def test_a_damaged_state_is_not_believed(tmp_path: Path, text: str) -> None:
    (tmp_path / "state.json").write_text(text)
    assert State(tmp_path / "state.json").stale
