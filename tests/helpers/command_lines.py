"""Every parser of the command line, and the commands that its help shows."""

from __future__ import annotations

import argparse
import re
import shlex
from collections.abc import Iterator

from drslamd import cli


def with_verbs(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """A parser, its verbs, and theirs."""
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                yield from with_verbs(verb)


PARSERS = {parser.prog: parser for parser in with_verbs(cli.parser())}


def examples(text: str) -> list[list[str]]:
    """Arguments of each of our commands in a help; a remark stands two spaces off."""
    commands = re.findall(
        r"^ +(?:sudo )?drslamd (.*)$", text.partition("examples:")[2], re.MULTILINE
    )
    return [shlex.split(re.split(r"\s{2,}", command)[0], comments=True) for command in commands]
