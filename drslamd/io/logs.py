"""The log: structlog on stderr, one event per line.

Whoever logs takes `get_logger` from here. structlog looks for rich, to print exceptions in colours,
and where another program of this host has it that costs a daemon 5 MB and a tenth of a second for
what it never prints: its lines are plain.
"""

from __future__ import annotations

import sys

from drslamd.config import DaemonSection
from drslamd.host.loading import without

with without("rich"):
    import structlog

_LEVELS = {"debug": 10, "info": 20, "warning": 30, "error": 40}

get_logger = structlog.get_logger


def set_up(section: DaemonSection) -> None:
    """Lines as people read them, or JSON for machines."""
    renderer: structlog.typing.Processor
    if section.log_format == "json":
        renderer = structlog.processors.JSONRenderer()
    else:
        renderer = structlog.processors.LogfmtRenderer(key_order=["timestamp", "level", "event"])
    structlog.configure(
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso"),
            structlog.processors.format_exc_info,
            renderer,
        ],
        wrapper_class=structlog.make_filtering_bound_logger(_LEVELS[section.log_level]),
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
    )
