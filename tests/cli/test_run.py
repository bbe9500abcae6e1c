"""``drslamd run`` before there is a daemon; its ends are tested in `deploy`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def test_a_bad_configuration_is_refused_before_anything_heavy_is_loaded(config: Path) -> None:
    config.write_text(config.read_text().replace("id = 3", "id = 999"))
    code = (
        "import sys; from drslamd import cli; "
        f"code = cli.main(['run', '-c', {str(config)!r}]); "
        "print(code, 'numpy' in sys.modules)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert answer.stdout == "78 False\n"
