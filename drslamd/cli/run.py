"""``drslamd run``: the daemon in the foreground."""

from __future__ import annotations

import argparse
import asyncio
import os
import signal
import sys
from typing import NoReturn

from drslamd.cli.exit_codes import BUG, OK
from drslamd.cli.parser import Verbs, configured_verb, load
from drslamd.config import Config
from drslamd.host.ending import stops


def add(verbs: Verbs) -> None:
    """Add the verb."""
    configured_verb(
        verbs,
        "run",
        _run,
        "run the daemon in the foreground",
        "  drslamd run -c /etc/drslamd/3.toml         until it is stopped (systemd: drslamd@3)",
    )


def _run(options: argparse.Namespace) -> int:
    # one BLAS thread: the same bits on every machine, and a core left for the sensors
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    config = load(options.config)  # before the modules that take their time
    _heed_signals()
    from drslamd.cli.verdict import exit_code, lines
    from drslamd.io.claim import Claim, holder
    from drslamd.machine.folders import socket_path
    from drslamd.machine.refusals import already_runs, refusals

    found = refusals(config)
    if not found:
        path = socket_path(config)
        with Claim(path) as is_ours:
            if is_ours:
                return _serve(config)
        found = [already_runs(config, holder(path))]
    print("\n".join(lines(options.config, found)), file=sys.stderr)
    return exit_code(found)


def _heed_signals() -> None:
    """Until the daemon listens itself: the modules take half a second to load."""
    for number in stops():
        signal.signal(number, lambda *_: os._exit(OK))


def _serve(config: Config) -> NoReturn:
    """Until it is stopped; the process ends here."""
    from drslamd.daemon import Daemon
    from drslamd.io.logs import get_logger, set_up

    set_up(config.daemon)

    daemon, code = Daemon(config), OK
    try:
        asyncio.new_event_loop().run_until_complete(daemon.run())
    except Exception:
        get_logger().exception("daemon.bug", remedy="please report this")
        code = BUG
    sys.stdout.flush()
    sys.stderr.flush()
    # at once: nobody waits for a solve or an adapter that is being opened, and until the very end
    # a second signal finds the daemon's handler, not Python's, which would change the exit code
    os._exit(code)
