"""What is played of the pose to steer by, and what is left out."""

from __future__ import annotations

import sys

import pytest
from lab.near import __main__ as near


def test_without_seeds_nothing_is_played(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["near", "--seeds", "0", "--robots"])
    assert near.main() == 0
    assert capsys.readouterr().out == ""
