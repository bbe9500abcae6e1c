"""``drslamd doctor``: what is wrong with this robot, since when, and what to do."""

from __future__ import annotations

import argparse
import json
import time
from typing import TYPE_CHECKING

from drslamd.cli.exit_codes import FOUND, OK, UNAVAILABLE
from drslamd.cli.parser import Verbs, configured_verb, load
from drslamd.config import Config

if TYPE_CHECKING:
    from drslamd.doctor.patient import Patient
    from drslamd.machine.finding import Finding

BETWEEN_S = 2.0
"""Between two answers of the daemon, of which the differences are rates."""
EXAMPLES = """\
  drslamd doctor -c /etc/drslamd/3.toml            causes first, each with what to do
  drslamd doctor -c /etc/drslamd/3.toml --json     the same for a program

exit codes: 0 nothing is wrong, 1 something is, 69 no daemon answers, 78 none would start"""


def add(verbs: Verbs) -> None:
    """Add the verb."""
    doctor = configured_verb(
        verbs, "doctor", _doctor, "look for what is wrong with the robot and its daemon", EXAMPLES
    )
    doctor.add_argument("--json", action="store_true", help="as JSON")


def _doctor(options: argparse.Namespace) -> int:
    from drslamd.cli.service_user import as_user, user_of_service

    user = user_of_service(options.config)
    return as_user(user, lambda: _look(options)) if user else _look(options)


def _look(options: argparse.Namespace) -> int:
    from drslamd.cli.ask import NoAnswer
    from drslamd.cli.verdict import exit_code
    from drslamd.doctor import rounds

    config = load(options.config)
    found, no_answer = rounds.of_machine(config), ""
    try:
        daemon = rounds.of_daemon(_patient(config, options.config))
        found = rounds.together(found, daemon)
    except NoAnswer as error:
        no_answer = str(error)
    refused = exit_code(found)
    code = UNAVAILABLE if no_answer else FOUND if found else OK
    if no_answer and refused:
        code = refused
    _print(options.json, found, no_answer, code)
    return code


def _patient(config: Config, config_path: str) -> Patient:
    """Two looks at the daemon.

    Raises:
        NoAnswer: there is none.
    """
    from drslamd.cli.ask import answer
    from drslamd.doctor.patient import Patient
    from drslamd.machine.folders import socket_to_ask

    path = socket_to_ask(config)
    before, then = answer(path, "status", config_path), time.monotonic()
    time.sleep(BETWEEN_S)
    now = answer(path, "status", config_path)
    return Patient(config, before, now, time.monotonic() - then)


def _print(as_json: bool, found: list[Finding], no_answer: str, code: int) -> None:
    from drslamd.cli.verdict import as_table

    if as_json:
        answer = {"exit_code": code, "no_answer": no_answer, "findings": as_table(found)}
        print(json.dumps(answer, indent=2))
        return
    print("\n".join(_lines(found, no_answer)))


def _lines(found: list[Finding], no_answer: str) -> list[str]:
    from drslamd.doctor.rounds import names
    from drslamd.reports.status_table import span

    out = []
    for finding in found:
        since = "" if finding.since_s is None else f" (since {span(finding.since_s)})"
        # a cause that begins with what was looked at needs no other heading
        is_named = finding.cause.startswith(finding.check.split()[0])
        heading = "" if is_named else f"{finding.check}: "
        out.append(f"{finding.severity.value}: {heading}{finding.cause}{since}")
        out += [f"    {finding.remedy}"] if finding.remedy else []
    if no_answer:
        return [*out, no_answer]
    if found:
        return [*out, f"{len(found)} found by {len(names())} checks, what may be a cause first"]
    return [f"nothing is wrong; looked at: {', '.join(names())}"]
