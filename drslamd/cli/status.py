"""``drslamd status``: how a running daemon is."""

from __future__ import annotations

import argparse
import json
import sys

from drslamd.cli.ask import NoAnswer, ask_daemon, socket_of
from drslamd.cli.exit_codes import OK, UNAVAILABLE
from drslamd.cli.parser import Verbs, configured_verb

EXAMPLES = """\
  drslamd status -c /etc/drslamd/3.toml            what it hears, and why it is not localised
  drslamd status -c /etc/drslamd/3.toml --watch    the same as a live table, until Ctrl-C"""


def add(verbs: Verbs) -> None:
    """Add the verb."""
    status = configured_verb(
        verbs,
        "status",
        _status,
        "ask a running daemon how it is",
        EXAMPLES,
    )
    form = status.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="everything, as JSON")
    form.add_argument("--watch", action="store_true", help="a table, anew each second, to Ctrl-C")


def _status(options: argparse.Namespace) -> int:
    if options.watch:
        return _watch(options)
    answer = ask_daemon(options.config, "status")
    if answer is None:
        return UNAVAILABLE
    if options.json:
        print(json.dumps(answer, indent=2))
    else:
        from drslamd.reports.status_text import lines

        print("\n".join(lines(answer)))
    return OK


def _watch(options: argparse.Namespace) -> int:
    from drslamd.cli.watch import watch

    try:
        return watch(socket_of(options.config), options.config)
    except NoAnswer as error:
        print(error, file=sys.stderr)
        return UNAVAILABLE
