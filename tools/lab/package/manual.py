"""Pages of the manual, written from the parsers: one for the program, one for each verb."""

from __future__ import annotations

import argparse
import datetime
import re
from collections.abc import Iterator


def pages(parser: argparse.ArgumentParser, version: str, epoch: int) -> dict[str, str]:
    """The text of each page by its file name, dated by `epoch` in seconds.

    A verb that has verbs of its own has pages for them.
    """
    day = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).date()
    all_parsers = list(_with_verbs(parser, ""))
    names = [_page_name(one) for one, _ in all_parsers]
    written = {}
    for (one, purpose), name in zip(all_parsers, names, strict=True):
        others = [other for other in names if other != name]
        lines = [f'.TH {name.upper()} 1 {day} "drslamd {version}" "User Commands"']
        lines += _body(one, purpose or one.description or "", name, others)
        written[f"{name}.1"] = "\n".join(lines) + "\n"
    return written


def configuration_page(example: str, version: str, epoch: int) -> str:
    """drslamd.toml(5): the example, in which each key has its default and a comment."""
    day = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).date()
    lines = [f'.TH DRSLAMD.TOML 5 {day} "drslamd {version}" "File Formats"']
    lines += [".SH NAME", r"drslamd.toml \- configuration of one robot", ".SH DESCRIPTION"]
    lines += ["The service drslamd@3 reads /etc/drslamd/3.toml. All keys, with their defaults:"]
    lines += _verbatim(example.splitlines())
    lines += [".SH SEE ALSO", ".BR drslamd (1),", r".BR drslamd\-check (1)"]
    return "\n".join(lines) + "\n"


def _with_verbs(
    parser: argparse.ArgumentParser, purpose: str
) -> Iterator[tuple[argparse.ArgumentParser, str]]:
    """A parser and those of its verbs, each with the help that its parent gives."""
    yield parser, purpose
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            helps = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for name, verb in action.choices.items():
                yield from _with_verbs(verb, helps.get(name, ""))


def _page_name(parser: argparse.ArgumentParser) -> str:
    """``drslamd check`` has the page ``drslamd-check``."""
    return parser.prog.replace(" ", "-")


def _body(
    parser: argparse.ArgumentParser, purpose: str, name: str, others: list[str]
) -> Iterator[str]:
    yield from [".SH NAME", f"{_escaped(name)} \\- {_escaped(purpose.rstrip('.'))}"]
    yield from [".SH SYNOPSIS", *_synopsis(parser)]
    yield from [".SH DESCRIPTION", *_plain((parser.description or "").splitlines())]
    shown = [action for action in parser._actions if action.help != argparse.SUPPRESS]
    for verbs in shown:
        if isinstance(verbs, argparse._SubParsersAction):
            yield ".SH COMMANDS"
            for choice in verbs._choices_actions:
                page = _escaped(f"{name}-{choice.dest}")
                yield from [".TP", f".BR {page} (1)", *_plain([choice.help or ""])]
    yield ".SH OPTIONS"
    for action in shown:
        if not isinstance(action, argparse._SubParsersAction):
            yield from [".TP", _headline(action), *_plain([_help(parser, action)])]
    yield from _ending(parser.epilog or "")
    if others:
        yield ".SH SEE ALSO"
        yield ",\n".join(f".BR {_escaped(other)} (1)" for other in others)


def _synopsis(parser: argparse.ArgumentParser) -> list[str]:
    usage = " ".join(parser.format_usage().split()).removeprefix("usage: ")
    rest = usage.removeprefix(parser.prog).strip()
    return [f".B {_escaped(parser.prog)}", *_plain([rest])]


def _headline(action: argparse.Action) -> str:
    """Of one option or argument, names in bold and its value in italics."""
    values = ""
    if action.nargs != 0:
        chosen = "{" + ",".join(map(str, action.choices or ())) + "}" if action.choices else ""
        unnamed = action.dest.upper() if action.option_strings else action.dest
        word = action.metavar or chosen or unnamed
        values = rf"\fI{_escaped(word if isinstance(word, str) else ' '.join(word))}\fR"
    names = ", ".join(rf"\fB{_escaped(option)}\fR" for option in action.option_strings)
    return " ".join(part for part in (names, values) if part)


def _help(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    return parser._get_formatter()._expand_help(action) if action.help else ""


def _ending(epilog: str) -> Iterator[str]:
    """Each paragraph with a heading becomes a section: ``examples:``, ``exit codes: ...``."""
    for paragraph in re.split(r"\n\s*\n", epilog.strip("\n")):
        headed = re.match(r"([a-z][a-z ]+): *", paragraph)
        if headed is None:
            yield from [".PP", *_plain(paragraph.splitlines())]
            continue
        title = headed[1].upper().replace("EXIT CODES", "EXIT STATUS")
        yield f".SH {_escaped(title)}"
        lines = paragraph[headed.end() :].strip("\n").splitlines()
        yield from _verbatim(lines) if lines[0].startswith("  ") else _plain(lines)


def _verbatim(lines: list[str]) -> list[str]:
    return [".nf", *(_protected(_escaped(line)) for line in lines), ".fi"]


def _plain(lines: list[str]) -> list[str]:
    return [_protected(_escaped(line.strip())) for line in lines if line.strip()]


def _escaped(text: str) -> str:
    r"""A minus that can be copied, a backslash that is one."""
    return text.replace("\\", r"\e").replace("-", r"\-")


def _protected(line: str) -> str:
    """A dot or an apostrophe at the beginning of a line would be a request."""
    return rf"\&{line}" if line[:1] in (".", "'") else line
