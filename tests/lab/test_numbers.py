"""Numbers on a command line: one case on each side of a bound, and no number without one."""

from __future__ import annotations

import argparse
import re

import pytest
from lab import demo, numbers
from places import REPOSITORY


@pytest.mark.parametrize(
    ("text", "value"),
    [("2", 2), ("30", 30), ("1", None), ("31", None), ("2.5", None), ("two", None), ("nan", None)],
)
def test_whole_numbers_have_a_least_and_a_most(text: str, value: int | None) -> None:
    read = numbers.whole(2, 30)
    if value is not None:
        assert read(text) == value
        return
    with pytest.raises(argparse.ArgumentTypeError, match=f"^{text}: a whole number, 2 to 30$"):
        read(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [("0.5", 0.5), ("1e3", 1000.0), ("0.49", None), ("inf", None), ("nan", None), ("m", None)],
)
def test_other_numbers_too_and_not_a_number_is_none(text: str, value: float | None) -> None:
    read = numbers.real(0.5)
    if value is not None:
        assert read(text) == value
        return
    with pytest.raises(argparse.ArgumentTypeError, match=f"^{text}: a number, at least 0.5$"):
        read(text)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--robots", "1"],  # alone it is nowhere
        ["--robots", "300"],
        ["--seconds", "0"],
        ["--seconds", "nan"],
        ["--seed", "-1"],
    ],
)
def test_a_world_that_cannot_be_is_said_before_it_begins(
    arguments: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # or three hundred daemons would start
    monkeypatch.setattr(demo, "_recording", lambda _: pytest.fail("it begins"))
    with pytest.raises(SystemExit) as ended:
        demo.main(arguments)
    assert ended.value.code == 2
    assert f"argument {arguments[0]}: {arguments[1]}: a " in capsys.readouterr().err


def test_no_command_takes_a_number_without_bounds() -> None:
    lab = REPOSITORY / "tools" / "lab"
    bare = re.compile(r"\btype=(?:int|float)\b")
    assert [path for path in lab.rglob("*.py") if bare.search(path.read_text())] == []
