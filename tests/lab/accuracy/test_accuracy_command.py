"""The command line of tools/accuracy: its table and its exit codes."""

from __future__ import annotations

from pathlib import Path

import pytest
from lab.accuracy.__main__ import NO_INPUT, main, markdown
from lab.accuracy.accuracy_rows import Figure


@pytest.mark.parametrize(
    ("reached", "is_least", "mark"),
    [(0.15, False, "yes"), (0.151, False, "**no**"), (0.15, True, "yes"), (0.149, True, "**no**")],
)
def test_the_table_says_what_is_reached(reached: float, is_least: bool, mark: str) -> None:
    lines = markdown([Figure("made", "position", reached, 0.15, "m", is_least)])
    assert lines[-1].endswith(f"| {mark} |")


def test_a_section_in_both_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "other.toml"
    config.write_text("[relative_pose]\ndelta = 0.2\n")
    with pytest.raises(SystemExit) as end:
        main([str(tmp_path), "--without", "nlos", "--config", str(config)])
    assert end.value.code == 2
    assert "[relative_pose]" in capsys.readouterr().err
    assert main([str(tmp_path), "--without", "narrow-priors"]) == NO_INPUT
