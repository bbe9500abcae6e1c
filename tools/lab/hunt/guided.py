"""One target under atheris, which looks for bytes that reach new branches."""

from __future__ import annotations

import sys


def fuzz(name: str, corpus: str, seconds: int) -> None:
    """Until the time is over or something is found; ends the process."""
    import atheris

    with atheris.instrument_imports(include=["drslamd"]):
        from lab.hunt.targets import TARGETS
    take = TARGETS[name]()
    limits = [f"-max_total_time={seconds}", "-max_len=1500", "-rss_limit_mb=1024"]
    atheris.Setup([sys.argv[0], corpus, *limits, f"-artifact_prefix={corpus}-"], take)
    atheris.Fuzz()
