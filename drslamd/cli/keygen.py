"""``drslamd keygen``: a secret for the team."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from drslamd.cli.exit_codes import CANNOT_CREATE, OK
from drslamd.cli.parser import Verbs, verb
from drslamd.host.unmade import unmade


def add(verbs: Verbs) -> None:
    """Add the verb."""
    keygen = verb(
        verbs,
        "keygen",
        _keygen,
        "make a team key, mode 0600",
        "  drslamd keygen /etc/drslamd/team.key       once; copy it to every robot",
    )
    keygen.add_argument("file", metavar="FILE", help="where; nothing may be there yet")


def _keygen(options: argparse.Namespace) -> int:
    from drslamd.io.state_store import write_key

    try:
        write_key(Path(options.file))
    except OSError as error:
        print(unmade(options.file, error), file=sys.stderr)
        return CANNOT_CREATE
    print(f"{options.file}: copy it to every robot of the team, mode 0600")
    return OK
