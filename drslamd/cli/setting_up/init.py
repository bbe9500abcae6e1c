"""``drslamd init``: the configuration of a robot, from what is plugged in."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from drslamd.cli.exit_codes import CANNOT_CREATE, OK, USAGE
from drslamd.cli.parser import Verbs, verb
from drslamd.config import ConfigError, parse
from drslamd.config_wheels import SOURCES
from drslamd.host.unmade import unmade

FOLDER = Path("/etc/drslamd")
EXAMPLES = """\
  drslamd init                               look at all ports, ask, write /etc/drslamd/ID.toml
  drslamd init --dry-run                     the same, but only print the file
  drslamd init --id 3 --new-key /etc/drslamd/team.key --interface wlan0
  drslamd init --id 4 --key /etc/drslamd/team.key --base roboteq --allow-write
      --wheel track_m=0.5 --wheel counts_per_metre=10000 --wheels-port /dev/ttyACM0
  drslamd init --json --dry-run              what was found, for a program"""


def add(verbs: Verbs) -> None:
    """Add the verb."""
    init = verb(
        verbs,
        "init",
        _init,
        "look at what is plugged in and write the configuration of a robot",
        EXAMPLES,
    )
    init.add_argument(
        "-c", "--config", metavar="FILE", help=f"where to write it (default: {FOLDER}/ID.toml)"
    )
    init.add_argument("--id", type=int, metavar="N", help="robot.id (default: that of its module)")
    init.add_argument("--uwb-port", metavar="PATH", default="", help="port of the LinkTrack")
    init.add_argument("--wheels-port", metavar="PATH", default="", help="port of the base")
    init.add_argument(
        "--port", metavar="PATH", action="append", default=[], help="look only here (repeat it)"
    )
    init.add_argument("--base", choices=[*SOURCES], default="", help="wheels.source")
    init.add_argument(
        "--wheel",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="a key of [wheels], such as track_m=0.5 (repeat it)",
    )
    init.add_argument(
        "--allow-write",
        action="store_true",
        help="ask silent ports for a Roboteq; never a port that speaks, nor a LinkTrack's USB chip",
    )
    init.add_argument("--interface", metavar="NAME", default="", help="network to the team")
    key = init.add_mutually_exclusive_group()
    key.add_argument("--key", metavar="FILE", default="", help="the team's key, which exists")
    key.add_argument("--new-key", metavar="FILE", default="", help="make the team's key there")
    key.add_argument("--insecure", action="store_true", help="no key: anybody can forge messages")
    init.add_argument("--force", action="store_true", help="overwrite the file")
    init.add_argument("--dry-run", action="store_true", help="print the file, write nothing")
    init.add_argument("--json", action="store_true", help="what was found, as JSON; asks nobody")


def _init(options: argparse.Namespace) -> int:
    from drslamd.cli.setting_up.asking import NobodyAnswers, is_a_person_there
    from drslamd.cli.setting_up.init_choices import Chooser, WrongFlag
    from drslamd.setup.first_config import toml

    try:
        chooser = Chooser(options, is_person=is_a_person_there() and not options.json)
        chooser.look()
        chosen = chooser.chosen()
    except WrongFlag as error:
        return _fail(str(error), USAGE)
    except NobodyAnswers:
        return _fail("no answer; drslamd init --help shows the flags that say it", USAGE)
    except KeyboardInterrupt:
        return _fail("interrupted; nothing was written", USAGE)
    found: dict[str, Any] = {**chooser.found(), "missing": [str(m) for m in chooser.missing]}
    if chosen is None:
        if options.json:
            print(json.dumps(found, indent=2))
        for missing in chooser.missing:
            print(f"drslamd init: {missing}", file=sys.stderr)
        return USAGE
    path = Path(options.config or FOLDER / f"{chosen.robot}.toml")
    text = toml(chosen)
    try:
        parse(text, str(path.resolve().parent))
    except ConfigError as error:
        return _fail("\n".join(error.faults), USAGE)
    code = OK if options.dry_run else _write(path, text, options)
    if code == OK:
        _tell(options, found, path, text)
    return code


def _write(path: Path, text: str, options: argparse.Namespace) -> int:
    from drslamd.cli.setting_up.writing import give_to_service, write_whole
    from drslamd.io.state_store import write_key

    if path.exists() and not options.force:
        return _fail(f"{path}: it exists; overwrite it with --force", CANNOT_CREATE)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if options.new_key:
            write_key(Path(options.new_key))
            give_to_service(Path(options.new_key))
        write_whole(path, text, may_replace=options.force)
    except OSError as error:
        where = error.filename or path
        is_key = isinstance(error, FileExistsError) and str(where) == options.new_key
        said = f"{where}: {error.strerror}; name it with --key" if is_key else unmade(where, error)
        return _fail(said, CANNOT_CREATE)
    return OK


def _tell(options: argparse.Namespace, found: dict[str, Any], path: Path, text: str) -> None:
    """What was done, and what to do next."""
    following = [
        f"drslamd check -c {path}",
        f"drslamd calibrate -c {path}",
    ]
    if options.json:
        is_written = not options.dry_run
        said = {**found, "file": str(path), "written": is_written, "toml": text, "next": following}
        print(json.dumps(said, indent=2))
        return
    if options.dry_run:
        print(text, end="")
        return
    print(f"{path}: written")
    if options.new_key:
        print(f"{options.new_key}: made; copy it to every robot of the team, mode 0600")
    print(f"next: {following[0]}\nthen: {following[1]}")


def _fail(sentence: str, code: int) -> int:
    print("\n".join(f"drslamd init: {line}" for line in sentence.splitlines()), file=sys.stderr)
    return code
