"""The command ``drslamd``.

Exit codes: 0 done, 64 wrong usage, 69 no daemon answers, 70 a bug of ours, 73 a file that cannot
be made, 78 a configuration that cannot be used.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
import sys
from pathlib import Path
from typing import Any, NoReturn

from drslamd import __version__
from drslamd.config import Config, ConfigError, parse

OK, USAGE, UNAVAILABLE, BUG, CANNOT_CREATE, BAD_CONFIG = 0, 64, 69, 70, 73, 78

EXAMPLES = """\
examples:
  drslamd keygen /etc/drslamd/team.key       a secret for the team; copy it to every robot
  drslamd check -c /etc/drslamd/3.toml       is the configuration right?
  drslamd run -c /etc/drslamd/3.toml         the daemon (systemd: drslamd@3)
  drslamd status -c /etc/drslamd/3.toml      what it hears, and why it is not localised
  drslamd trajectory -c /etc/drslamd/3.toml --tum out/

exit codes: 0 done, 64 wrong usage, 69 no daemon answers, 70 a bug, 73 a file cannot be made,
78 the configuration cannot be used
"""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        self.exit(USAGE, f"{self.prog}: {message}\n")


def main(arguments: list[str] | None = None) -> int:
    """Run one verb; its exit code."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.verb(options))
    except ConfigError as error:
        for fault in error.faults:
            print(f"{options.config}: {fault}", file=sys.stderr)
        return BAD_CONFIG


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="drslamd",
        description="Where is everybody? UWB ranges and wheel odometry, no anchors.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"drslamd {__version__}")
    verbs = parser.add_subparsers(required=True, metavar="VERB")

    def verb(name: str, action: Any, help: str) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=help, description=help)
        sub.set_defaults(verb=action)
        return sub

    def configured(name: str, action: Any, help: str) -> argparse.ArgumentParser:
        sub = verb(name, action, help)
        sub.add_argument("-c", "--config", required=True, metavar="FILE", help="its TOML file")
        return sub

    configured("run", _run, "run the daemon in the foreground")
    check = configured("check", _check, "print the effective configuration, or what is wrong")
    check.add_argument("--json", action="store_true", help="as JSON")
    status = configured("status", _status, "ask a running daemon how it is")
    status.add_argument("--json", action="store_true", help="everything, as JSON")
    trajectory = configured("trajectory", _trajectory, "everybody's path in the team's frame")
    trajectory.add_argument("--tum", metavar="DIR", help="write one TUM file per robot there")
    keygen = verb("keygen", _keygen, "make a team key, mode 0600")
    keygen.add_argument("file", metavar="FILE")
    return parser


def _load(path: str) -> Config:
    try:
        text = Path(path).read_text()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError([reason]) from None
    return parse(text, str(Path(path).resolve().parent))


def _run(options: argparse.Namespace) -> int:
    # one BLAS thread: the same bits on every machine, and a core left for the sensors
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    config = _load(options.config)  # before the modules that take their time
    for number in (signal.SIGTERM, signal.SIGINT):
        # until the daemon listens itself: the modules take half a second to load
        signal.signal(number, lambda *_: os._exit(OK))
    import structlog

    from drslamd.daemon import Daemon
    from drslamd.io.logs import set_up

    set_up(config.daemon)

    daemon, code = Daemon(config), OK
    try:
        asyncio.new_event_loop().run_until_complete(daemon.run())
    except Exception:
        structlog.get_logger().exception("daemon.bug", remedy="please report this")
        code = BUG
    sys.stdout.flush()
    sys.stderr.flush()
    # at once: nobody waits for a solve or an adapter that is being opened, and until the very end
    # a second signal finds the daemon's handler, not Python's, which would change the exit code
    os._exit(code)


def _check(options: argparse.Namespace) -> int:
    config = _load(options.config)
    effective = config.model_dump(exclude_none=True)
    effective["uwb"]["id"] = config.uwb_id
    if options.json:
        print(json.dumps(effective, indent=2))
    else:
        print("\n".join(_toml(effective)).strip())
    return OK


def _toml(table: dict[str, Any], prefix: str = "") -> list[str]:
    """The effective configuration in the language of the file."""
    plain = {k: v for k, v in table.items() if not isinstance(v, dict)}
    lines = [f"[{prefix}]"] if prefix and plain else []
    lines += [f"{key} = {json.dumps(value)}" for key, value in plain.items()]
    for key, value in table.items():
        if isinstance(value, dict):
            lines += ["", *_toml(value, f"{prefix}.{key}" if prefix else key)]
    return lines


def _ask(options: argparse.Namespace, question: str) -> Any:
    from drslamd.daemon import socket_to_ask
    from drslamd.io.status_socket import ask

    path = socket_to_ask(_load(options.config))
    try:
        return asyncio.run(ask(path, question))
    except (OSError, ValueError, asyncio.TimeoutError) as error:
        print(f"no daemon answers at {path}: {error}", file=sys.stderr)
        return None


def _status(options: argparse.Namespace) -> int:
    answer = _ask(options, "status")
    if answer is None:
        return UNAVAILABLE
    if options.json:
        print(json.dumps(answer, indent=2))
    else:
        from drslamd.status_text import lines

        print("\n".join(lines(answer)))
    return OK


def _trajectory(options: argparse.Namespace) -> int:
    answer = _ask(options, "trajectory")
    if answer is None:
        return UNAVAILABLE
    if options.tum is None:
        print(json.dumps(answer))
        return OK
    from drslamd.io.tum import write

    try:
        for path in write(Path(options.tum), answer):
            print(path)
    except OSError as error:
        print(f"{options.tum}: {error.strerror}", file=sys.stderr)
        return CANNOT_CREATE
    return OK


def _keygen(options: argparse.Namespace) -> int:
    from drslamd.io.state_store import write_key

    try:
        write_key(Path(options.file))
    except OSError as error:
        print(f"{options.file}: {error.strerror}; keys are never overwritten", file=sys.stderr)
        return CANNOT_CREATE
    print(f"{options.file}: copy it to every robot of the team, mode 0600")
    return OK
