"""``drslamd check``: what the daemon would make of a configuration."""

from __future__ import annotations

import argparse
import json
from typing import Any

from drslamd.cli.exit_codes import OK
from drslamd.cli.parser import Verbs, configured_verb, load


def add(verbs: Verbs) -> None:
    """Add the verb."""
    check = configured_verb(
        verbs,
        "check",
        _check,
        "print the effective configuration, or what is wrong",
        "  drslamd check -c /etc/drslamd/3.toml       is the configuration right?",
    )
    check.add_argument("--json", action="store_true", help="as JSON")


def _check(options: argparse.Namespace) -> int:
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
