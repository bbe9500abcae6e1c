"""Completion for the shells, made from the parser by shtab."""

from __future__ import annotations

import argparse

import shtab

SHELLS = {
    "bash": "usr/share/bash-completion/completions/drslamd",
    "zsh": "usr/share/zsh/vendor-completions/_drslamd",
    "fish": "usr/share/fish/vendor_completions.d/drslamd.fish",
}
"""Where Debian looks for them."""

FILES = {"FILE": shtab.FILE, "LOG": shtab.FILE, "DIR": shtab.DIRECTORY, "FOLDER": shtab.DIRECTORY}
"""What the word for a value says about it."""


def scripts(parser: argparse.ArgumentParser) -> dict[str, str]:
    """The text of each shell's script by its path in the package."""
    _say_what_is_a_file(parser)
    return {path: shtab.complete(parser, shell) for shell, path in SHELLS.items()}


def _say_what_is_a_file(parser: argparse.ArgumentParser) -> None:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                _say_what_is_a_file(verb)
        elif action.metavar in FILES:
            action.complete = FILES[action.metavar]  # type: ignore[attr-defined]
