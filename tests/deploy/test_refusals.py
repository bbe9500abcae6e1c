"""What the daemon will not start with: a sentence, exit code 78, and nothing was opened."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from deploy_helpers import (
    ORDINARY,
    REPOSITORY,
    Daemon,
    command,
    environment,
    example_in,
    refused,
)
from machine_speed import allowed_s

from drslamd.cli.exit_codes import BAD_CONFIG, OK, USAGE
from drslamd.gossip.seal import KEY_BYTES

LONGEST_CPU_S = 1.6
"""Of a process that starts Python and reads its configuration: 0.3 to 0.8 s, twice as much where
other programs share the core, and more on a slower machine. What they do to the clock does not
count."""
SECRET = "5e" * KEY_BYTES

slow = pytest.mark.slow
as_ordinary_user = pytest.mark.skipif(not ORDINARY, reason="root may read anything")

SPY = """\
import json, os, sys
def note(event, args):
    device = event == "open" and str(args[0]).startswith("/dev/serial")
    network = event == "socket.__new__" and args[1] in (2, 10, 29)
    if device or network or event == "socket.bind":
        with open(os.environ["SPY_FILE"], "a") as file:
            file.write(json.dumps([event, repr(args)]) + "\\n")
sys.addaudithook(note)
"""


def spying(config: Path) -> dict[str, str]:
    """Environment of a process that notes the ports and the sockets that it opens."""
    folder = config.parent / "spy"
    folder.mkdir(exist_ok=True)
    (folder / "sitecustomize.py").write_text(SPY)
    return {"PYTHONPATH": f"{folder}:{REPOSITORY}", "SPY_FILE": str(folder / "seen")}


def opened(config: Path) -> list[str]:
    seen = config.parent / "spy" / "seen"
    return seen.read_text().splitlines() if seen.exists() else []


def with_key(folder: Path) -> Path:
    return example_in(folder, ("insecure = true", f'key_file = "{folder / "team.key"}"'))


def refusal(config: Path) -> str:
    """What a run says that ends with the right exit code, soon, and before it opens anything."""
    code, said, seconds = refused(config, **spying(config))
    assert code == BAD_CONFIG, said
    assert "Traceback" not in said
    assert not opened(config)
    # other programs can only make it longer, so the shortest of three is its own
    for _ in range(2):
        if seconds >= allowed_s(LONGEST_CPU_S):
            seconds = min(seconds, refused(config, **spying(config))[2])
    assert seconds < allowed_s(LONGEST_CPU_S)
    return said


def test_the_spy_sees_what_a_good_configuration_opens(tmp_path: Path) -> None:
    config = example_in(tmp_path)
    with Daemon(config, **spying(config)) as daemon:
        daemon.manager.wait_for("READY=1")
    text = "\n".join(opened(config))
    assert "socket.bind" in text
    assert "LINKTRACK" in text
    assert "Kobuki" in text


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("id = 1 ", "id = 256 ", "robot.id = 256: "),
        ("source =", "sauce =", "wheels.sauce = 'kobuki': unknown key; did you mean source?"),
        ('source = "kobuki"', 'source = "kabuki"', "wheels.source = 'kabuki': allowed are"),
        ("#baud = 921600", "baudrate = 921600", "uwb.baudrate = 921600: unknown key; did you"),
        ("insecure = true", "", "team: neither key_file (made by `drslamd keygen`) nor"),
        ("[uwb]", "[uwb", "not valid TOML: "),
    ],
)
@pytest.mark.row("O1")
def test_a_wrong_configuration_is_named_before_anything_is_opened(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    config = example_in(tmp_path, (old, new))
    said = refusal(config)
    assert said.startswith(f"{config}: {sentence}")
    assert not (tmp_path / "state").exists()


@pytest.mark.row("S11")
@pytest.mark.parametrize(
    ("content", "mode", "sentence"),
    [
        (SECRET, 0o644, "mode 0644 lets others read it; chmod 600 "),
        pytest.param(SECRET, 0o640, "mode 0640 lets others read it; chmod 600 ", marks=slow),
        ("", 0o600, "not a team key; make one with: drslamd keygen "),
        pytest.param(SECRET[:-2], 0o600, "not a team key; make one", marks=slow),
        pytest.param(SECRET.replace("5", "x"), 0o600, "not a team key; make one", marks=slow),
        pytest.param(None, 0o600, "No such file or directory", marks=slow),
        pytest.param(SECRET, 0o000, "Permission denied", marks=[slow, as_ordinary_user]),
    ],
    ids=["0644", "0640", "empty", "short", "not hexadecimal", "missing", "unreadable"],
)
def test_a_team_key_that_is_none_or_no_secret_is_refused(
    tmp_path: Path, content: str | None, mode: int, sentence: str
) -> None:
    path = tmp_path / "team.key"
    if content is not None:
        path.write_text(content)
        path.chmod(mode)
    said = refusal(with_key(tmp_path))
    assert f"team.key_file = '{path}': {sentence}" in said
    assert SECRET[:8] not in said


@pytest.mark.row("S12")
@slow
def test_a_key_from_keygen_is_accepted_and_never_shown(tmp_path: Path) -> None:
    path = tmp_path / "team.key"
    made = subprocess.run(command("keygen", str(path)), env=environment(), check=False)
    assert made.returncode == OK
    secret = path.read_text().strip()
    with Daemon(with_key(tmp_path)) as daemon:
        daemon.manager.wait_for("READY=1")
        status = daemon.ask() + daemon.ask("--json")
        daemon.signal(signal.SIGTERM)
        assert daemon.wait() == OK
    assert "INSECURE" not in status
    for text in (status, daemon.log, json.dumps(daemon.state())):
        assert secret not in text


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda path: None, "No such file or directory"),
        (lambda path: path.mkdir(), "Is a directory"),
        pytest.param(lambda path: path.write_bytes(b"\xff\xfe"), "not a text file", marks=slow),
        pytest.param(
            lambda path: path.touch(0o000), "Permission denied", marks=[slow, as_ordinary_user]
        ),
    ],
    ids=["missing", "folder", "binary", "unreadable"],
)
def test_a_configuration_file_that_cannot_be_read_is_named(
    tmp_path: Path, make: Callable[[Path], object], sentence: str
) -> None:
    path = tmp_path / "robot.toml"
    make(path)
    assert refusal(path).startswith(f"{path}: {sentence}; ")


def test_wrong_usage_ends_with_64_and_shows_the_usage(tmp_path: Path) -> None:
    done = subprocess.run(
        command("run"), env=environment(), capture_output=True, text=True, check=False
    )
    assert done.returncode == USAGE
    assert done.stderr.startswith("usage: ")
