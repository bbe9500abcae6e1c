"""What the pages teach is what the programs take: every piece of TOML, every command line."""

from __future__ import annotations

import argparse
import importlib
import os
import re
import shlex
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

import pytest
import tomli
from pages import Page, pages, read
from places import REPOSITORY

from drslamd import cli
from drslamd.cli.check import toml_lines
from drslamd.config import Config, ConfigError, parse
from drslamd.config_wheels import SOURCES

PAGES = pages()

MINIMAL = tomli.loads(
    """
    robot.id = 3
    team.insecure = true
    uwb.port = "/dev/uwb"
    wheels.source = "kobuki"
    wheels.port = "/dev/wheels"
    """
)
NOT_OURS = {"state"}
"""Fields of messages that a page writes like keys."""

SHELL_TOOLS = {"tools/format", "tools/lcm-types", "tools/venv"}
"""Those without a parser."""
PROGRAMS = {
    f"tools/{path.name}"
    for path in (REPOSITORY / "tools").iterdir()
    if path.is_file() and os.access(path, os.X_OK)
}


OURS = re.compile(
    r"(sudo |[A-Z_]+=\S+ )*(/\S+/)?(?P<program>drslamd|tools/[\w-]+)(?P<arguments>( .*)?)"
)
"""A command line of one of our programs."""


# TOML


def is_toml(block: str) -> bool:
    """Has it a section of ours? Those of systemd and networkd begin with capitals."""
    return re.search(r"^\[[a-z_.]+\]", block, re.MULTILINE) is not None


def faults(fragment: dict[str, Any]) -> list[str]:
    """Of a fragment, with what it leaves out from the smallest configuration."""
    merged = dict(MINIMAL)
    for name, value in fragment.items():
        is_whole = name == "wheels" or not isinstance(value, dict)
        merged[name] = value if is_whole else {**MINIMAL.get(name, {}), **value}
    if "key_file" in merged["team"]:
        merged["team"] = {k: v for k, v in merged["team"].items() if k != "insecure"}
    try:
        parse("\n".join(toml_lines(merged)))
    except ConfigError as error:
        return error.faults
    return []


def wrong_blocks(page: Page) -> list[str]:
    blocks = [block for block in page.blocks if is_toml(block)]
    return [fault for block in blocks for fault in faults(tomli.loads(block))]


def wrong_keys(page: Page) -> list[str]:
    """Of `key = value` and `[section] key = value` in running text: what no section takes."""
    wrong = []
    for span in page.spans:
        match = re.fullmatch(r"(?:\[([a-z_]+)\] )?([a-z_]+) = (\S+)", span)
        if match is not None and match[2] not in NOT_OURS:
            section, key, value = match[1], match[2], tomli.loads(f"x = {match[3]}")["x"]
            wrong += (
                [] if any(is_taken(place, key, value) for place in standing(section)) else [span]
            )
    return wrong


def standing(section: str | None) -> list[dict[str, Any]]:
    """Where a key may stand, with what has to stand beside it."""
    named = [section] if section else [*Config.model_fields]
    sections: list[dict[str, Any]] = [
        {name: {}} for name in named if name not in ("wheels", "beacon")
    ]
    return sections + [{"wheels": {"source": source}} for source in SOURCES if "wheels" in named]


def is_taken(place: dict[str, Any], key: str, value: Any) -> bool:
    ((section, beside),) = place.items()
    said = faults({section: {**beside, key: value}})
    return not any(fault.startswith(f"{section}.{key} = ") for fault in said)


def test_every_piece_of_a_configuration_on_a_page_can_be_used() -> None:
    assert [(page.name, fault) for page in PAGES for fault in wrong_blocks(page)] == []
    assert sum(is_toml(block) for page in PAGES for block in page.blocks) >= 1


def test_every_key_with_a_value_on_a_page_is_one_of_the_configuration() -> None:
    assert [(page.name, span) for page in PAGES for span in wrong_keys(page)] == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('    [optimizer]\n    algorithm = "rbcd"\n', ""),
        ('    [optimizer]\n    algorithm = "paper"\n', "optimizer.algorithm = 'paper'"),
        ("```\n[gossip]\nttl = 99\n```\n", "gossip.ttl = 99"),
        ("```toml\n[optimiser]\nrank = 3\n```\n", "optimiser = {...}: unknown key"),
        ("```\n[Match]\nName=can0\n```\n", ""),
        ('    [team]\n    key_file = "k"\n    [robot]\n    id = 7\n', ""),
    ],
)
def test_a_wrong_piece_of_a_configuration_would_be_seen(text: str, fault: str) -> None:
    said = wrong_blocks(read("page", f"Text\n\n{text}\nmore text\n"))
    assert [sentence[: len(fault)] for sentence in said] == ([fault] if fault else [])


@pytest.mark.parametrize(
    ("span", "wrong"),
    [
        ('optimizer = "rbcd"', True),
        ('[optimizer] algorithm = "rbcd"', False),
        ('[optimizer] algorithm = "paper"', True),
        ('algorithm = "paper"', False),
        ('algorithm = "magic"', True),
        ('source = "dbc"', False),
        ('source = "ros"', True),
        ("max_bytes_per_s = 1", True),
        ("state = 0", False),
    ],
)
def test_a_wrong_key_in_running_text_would_be_seen(span: str, wrong: bool) -> None:
    assert wrong_keys(read("page", f"It says `{span}`, so there.")) == ([span] if wrong else [])


# command lines


class Refused(Exception):
    """A parser does not take an argument."""


class _Built(BaseException):
    """A program has built its parser and is about to use it."""

    def __init__(self, parser: argparse.ArgumentParser) -> None:
        super().__init__()
        self.parser = parser


def parser_of(main: Callable[[list[str]], int]) -> argparse.ArgumentParser:
    """The parser that a program builds; nothing of it runs."""

    def stop(parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        raise _Built(parser)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(argparse.ArgumentParser, "parse_args", stop)
        try:
            main([])
        except _Built as built:
            return built.parser
    raise AssertionError("it has no parser")


def main_of(program: str) -> Callable[[list[str]], int]:
    if program == "drslamd":
        return cli.main
    script = (REPOSITORY / program).read_text()
    (name,) = re.findall(r"python -m ([\w.]+)", script)
    module = importlib.import_module(name)
    if not hasattr(module, "main"):
        module = importlib.import_module(f"{name}.__main__")
    main: Callable[[list[str]], int] = module.main
    return main


def check(program: str, arguments: list[str], is_whole: bool) -> None:
    """Does a program take these? Where it is only named, what it cannot do without may lack.

    Raises:
        Refused: there is no such program, verb, flag or value.
    """
    if program not in {"drslamd", *PROGRAMS}:
        raise Refused(f"there is no {program}")
    if program in SHELL_TOOLS:
        if any(argument.startswith("-") for argument in arguments):
            raise Refused(f"{program} takes no flags")
        return
    parser = parser_of(main_of(program))

    def refuse(self: argparse.ArgumentParser, message: str) -> NoReturn:
        raise Refused(message)

    with pytest.MonkeyPatch.context() as patch:
        for kind in {type(parser), argparse.ArgumentParser}:
            patch.setattr(kind, "error", refuse)
        if not is_whole:
            ask_for_nothing(parser)
        parser.parse_args(filled(parser, arguments))


def ask_for_nothing(parser: argparse.ArgumentParser) -> None:
    for action in parser._actions:
        action.required = False
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                ask_for_nothing(verb)


def filled(parser: argparse.ArgumentParser, arguments: list[str]) -> list[str]:
    """With a value in the place of each word that only stands for one."""
    by_option = {option: a for a in parser._actions for option in a.option_strings if a.choices}
    values = {option: str(next(iter(a.choices or ()))) for option, a in by_option.items()}
    out = [""]
    for argument in arguments:
        out.append(values.get(out[-1], argument) if argument.isupper() else argument)
    return out[1:]


def commands(block: str) -> Iterator[tuple[str, list[str]]]:
    """Our programs in lines of a shell, each with its arguments."""
    for line in block.splitlines():
        plain = re.split(r"\s#|\s{2,}", line.strip())[0]
        plain = re.sub(r"\[|\]|\.\.\.", " ", plain)  # what may be left out
        for part in re.split(r"&&|\|\||[;|]", plain):
            match = OURS.fullmatch(part.strip())
            if match is not None:
                yield match["program"], shlex.split(match["arguments"])


def wrong_commands(page: Page) -> list[str]:
    wrong = []
    whole = [(command, True) for block in page.blocks for command in commands(block)]
    named = [(command, False) for span in page.spans for command in commands(span)]
    for (program, arguments), is_whole in whole + named:
        try:
            check(program, arguments, is_whole)
        except Refused as error:
            wrong.append(f"{program} {' '.join(arguments)}: {error}")
    return wrong


def all_commands(page: Page) -> list[tuple[str, list[str]]]:
    return [command for text in page.blocks + page.spans for command in commands(text)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_on_a_page_is_one_that_its_program_takes(page: Page) -> None:
    assert wrong_commands(page) == []


def test_the_pages_name_every_tool_and_every_verb() -> None:
    named = [command for page in PAGES for command in all_commands(page)]
    assert PROGRAMS - {"tools/venv"} <= {program for program, _ in named}
    verbs = {arguments[0] for program, arguments in named if program == "drslamd" and arguments}
    names = {verb.__name__.rpartition(".")[2] for verb in cli.VERBS}
    # systemd runs it
    assert verbs | {"run"} == names | {"run"}


@pytest.mark.parametrize("program", ["drslamd", *sorted(PROGRAMS - SHELL_TOOLS)])
def test_the_examples_of_every_help_are_taken_by_its_program(program: str) -> None:
    epilog = str(parser_of(main_of(program)).epilog)
    examples = Page(program, [epilog.partition("\n\n")[0]], [])
    assert all_commands(examples)
    assert wrong_commands(examples) == []


@pytest.mark.parametrize(
    ("text", "is_wrong"),
    [
        ("    drslamd check -c /etc/drslamd/3.toml\n", False),
        ("    sudo /opt/drslamd/bin/drslamd status -c 3.toml --jsn   # comment\n", True),
        ("    true && drslamd fly -c 3.toml\n", True),
        ("    drslamd check\n", True),
        ("Say `drslamd check` now.\n", False),
        ("Say `drslamd check --quick` now.\n", True),
        ("    tools/benchmark --quick      two minutes\n", False),
        ("    tools/benchmark --module 9\n", True),
        ("    tools/accuracy FOLDER [--only ROW ...] [--without PIECE]\n", False),
        ("    tools/accuracy FOLDER [--with PIECE]\n", True),
        ("Say `tools/accurate FOLDER`.\n", True),
        ("    tools/lcm-types --all\n", True),
        ("    A_NAME=3 tools/demo --robots three\n", True),
    ],
)
def test_a_wrong_command_would_be_seen(text: str, is_wrong: bool) -> None:
    assert bool(wrong_commands(read("page", f"Text\n\n{text}"))) == is_wrong
