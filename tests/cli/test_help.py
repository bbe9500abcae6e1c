"""Help in place: every verb shows examples, and they are commands that it takes."""

from __future__ import annotations

import argparse

import pytest
from command_lines import PARSERS, examples

from drslamd import cli


@pytest.mark.parametrize("prog", PARSERS)
def test_every_help_has_examples_of_its_verb_that_can_be_typed(prog: str) -> None:
    found = examples(PARSERS[prog].format_help())
    assert found
    for arguments in found:
        assert f"drslamd {' '.join(arguments)}".startswith(prog)
        cli.parser().parse_args(arguments)


@pytest.mark.parametrize("prog", PARSERS)
def test_every_option_says_what_it_is_for(prog: str) -> None:
    verbs = argparse._SubParsersAction
    silent = [
        action.dest
        for action in PARSERS[prog]._actions
        if not action.help and not isinstance(action, verbs)
    ]
    assert silent == []


def test_a_remark_is_not_taken_for_an_argument() -> None:
    text = (
        "examples:\n  drslamd status -c a.toml      what it hears\n  sudo drslamd check -c b  # x\n"
    )
    assert examples(text) == [["status", "-c", "a.toml"], ["check", "-c", "b"]]


def test_a_wrong_example_would_be_seen() -> None:
    with pytest.raises(SystemExit):
        cli.parser().parse_args(examples("examples:\n  drslamd status -c a --jsn\n")[0])
