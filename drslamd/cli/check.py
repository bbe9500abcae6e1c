"""``drslamd check``: would the daemon run here, and if not, why?"""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from drslamd.cli.exit_codes import OK
from drslamd.cli.parser import Verbs, configured_verb, load
from drslamd.config import ConfigError

EXAMPLES = """\
  drslamd check -c /etc/drslamd/3.toml       would it run here? ends with run's exit code
  sudo drslamd check -c /etc/drslamd/3.toml  the same as the service's user, drslamd
  drslamd check -c 3.toml --config-only      every key as it counts, defaults too"""


def add(verbs: Verbs) -> None:
    """Add the verb."""
    check = configured_verb(
        verbs,
        "check",
        _check,
        "look at the configuration and the machine as run would",
        EXAMPLES,
    )
    check.add_argument(
        "--config-only", action="store_true", help="print the effective configuration, look no more"
    )
    check.add_argument("--user", metavar="NAME", help="look as this user does (needs root)")
    check.add_argument("--json", action="store_true", help="as JSON")


def _check(options: argparse.Namespace) -> int:
    if options.config_only:
        return _print_effective(options)
    from drslamd.cli.service_user import as_user, user_of_service

    user = options.user or user_of_service(options.config)
    if user is None:
        return _examine(options)
    return as_user(user, lambda: _examine(options, user))


def _examine(options: argparse.Namespace, user: str | None = None) -> int:
    """Look, print, and end as ``run`` would."""
    from drslamd.cli.verdict import as_table, exit_code, lines, verdict
    from drslamd.machine.examination import examination
    from drslamd.machine.refusals import of_config

    try:
        found = examination(load(options.config))
    except ConfigError as error:
        found = of_config(error)
    code, said = exit_code(found), verdict(found)
    if user is not None:
        said += f" (looked at as user {user}, as the service runs)"
    if options.json:
        answer = {"exit_code": code, "verdict": said, "findings": as_table(found)}
        print(json.dumps(answer, indent=2))
    else:
        print("\n".join([*lines(options.config, found), said]))
    sys.stdout.flush()
    return code


def _print_effective(options: argparse.Namespace) -> int:
    config = load(options.config)
    effective = config.model_dump(exclude_none=True)
    effective["uwb"]["id"] = config.uwb_id
    if options.json:
        print(json.dumps(effective, indent=2))
    else:
        print("\n".join(toml_lines(effective)).strip())
    return OK


def toml_lines(table: dict[str, Any], prefix: str = "") -> list[str]:
    """The effective configuration in the language of the file."""
    plain = {k: v for k, v in table.items() if not isinstance(v, dict)}
    lines = [f"[{prefix}]"] if prefix and plain else []
    lines += [f"{key} = {json.dumps(value)}" for key, value in plain.items()]
    for key, value in table.items():
        if isinstance(value, dict):
            lines += ["", *toml_lines(value, f"{prefix}.{key}" if prefix else key)]
    return lines
