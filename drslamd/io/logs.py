"""The log: structlog on stderr, one event per line."""

from __future__ import annotations

import sys

import structlog

from drslamd.config import DaemonSection

_LEVELS = {"debug": 10, "info": 20, "warning": 30, "error": 40}


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
