"""What all verbs have in common: a parser that ends with our exit code, and the configuration."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from drslamd.cli.exit_codes import USAGE
from drslamd.config import Config, ConfigError, parse
from drslamd.host.owners import denied

Verbs: TypeAlias = "argparse._SubParsersAction[Any]"
"""What the parser of a verb is added to."""

Action: TypeAlias = Callable[[argparse.Namespace], int]
"""Runs a verb with its options; returns the exit code."""


class Parser(argparse.ArgumentParser):
    """Wrong usage ends with 64."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        self.exit(USAGE, f"{self.prog}: {message}\n")


def verb(
    verbs: Verbs, name: str, action: Action, help: str, examples: str = ""
) -> argparse.ArgumentParser:
    """A new verb, of which ``drslamd NAME --help`` ends with `examples`."""
    parser: argparse.ArgumentParser = verbs.add_parser(
        name,
        help=help,
        description=help[0].upper() + help[1:] + ".",
        epilog=f"examples:\n{examples}" if examples else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(verb=action)
    return parser


def configured_verb(
    verbs: Verbs, name: str, action: Action, help: str, examples: str = ""
) -> argparse.ArgumentParser:
    """A verb of one robot, whose configuration it needs."""
    parser = verb(verbs, name, action, help, examples)
    parser.add_argument("-c", "--config", required=True, metavar="FILE", help="its TOML file")
    return parser


def load(path: str) -> Config:
    """The configuration in that file. Raises ConfigError, with a sentence for each fault."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError([_unreadable(path, error)]) from None
    return parse(text, str(Path(path).resolve().parent))


def _unreadable(path: str, error: OSError | UnicodeDecodeError) -> str:
    """Why there is no configuration in a file, and what to do."""
    if isinstance(error, FileNotFoundError):
        return f"{error.strerror}; correct the path, or make one: drslamd init -c {path}"
    if isinstance(error, PermissionError):
        return f"{error.strerror}; {denied(Path(path))}"
    if isinstance(error, IsADirectoryError):
        return f"{error.strerror}; name a file in it"
    reason = getattr(error, "strerror", None) or "not a text file"
    return f"{reason}; name a TOML file"
