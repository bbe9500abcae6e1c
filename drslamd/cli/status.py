"""``drslamd status``: how a running daemon is."""

from __future__ import annotations

import argparse
import json

from drslamd.cli.exit_codes import OK, UNAVAILABLE
from drslamd.cli.parser import Verbs, configured_verb


def add(verbs: Verbs) -> None:
    """Add the verb."""
    status = configured_verb(
        verbs,
        "status",
        _status,
        "ask a running daemon how it is",
        "  drslamd status -c /etc/drslamd/3.toml      what it hears, and why it is not localised",
    )
    status.add_argument("--json", action="store_true", help="everything, as JSON")


def _status(options: argparse.Namespace) -> int:
    from drslamd.cli.ask import ask_daemon  # what needs the daemon takes its time to load

    answer = ask_daemon(options.config, "status")
    if answer is None:
        return UNAVAILABLE
    if options.json:
        print(json.dumps(answer, indent=2))
    else:
        from drslamd.status_text import lines

        print("\n".join(lines(answer)))
    return OK
