"""The faults of a set-up that users make, each in a set-up that is in good order otherwise."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import NamedTuple

import pytest
from setup_scenes import SECRET, SERIAL_WHEELS, Setup

DBC = """\
VERSION ""
NS_ :
BS_:
BU_: Base
BO_ 256 Wheels: 8 Base
 SG_ Left : 0|32@1- (1,0) [0|0] "" Base
 SG_ Right : 32|32@1- (1,0) [0|0] "" Base
BO_ 257 Short: 4 Base
 SG_ Left : 0|16@1- (1,0) [0|0] "" Base
 SG_ Right : 16|16@1- (1,0) [0|0] "" Base
"""
CAN = '[wheels]\nsource = "dbc"\ntrack_m = 0.4\ndbc_file = "base.dbc"\n'
COUNTS = (
    'measures = "counts"\ncounts_per_metre = 1000\nleft = "Wheels.Left"\nright = "Wheels.Right"\n'
)
AGILEX = '[wheels]\nsource = "agilex"\ntrack_m = 0.4\n'

Make = Callable[[Setup, pytest.MonkeyPatch], object]


class Fault(NamedTuple):
    """One fault, the words of its cause and of its remedy.

    Attributes:
        code: that `run` ends with; 0 where it starts and waits.
        as_nobody: does it concern an ordinary user only?
    """

    name: str
    make: Make
    cause: str
    remedy: str
    code: int = 78
    as_nobody: bool = False


def changed(old: str, new: str) -> Make:
    """Another text in the configuration."""
    return lambda setup, _: setup.change((old, new))


def wheels(section: str, dbc: str | None = DBC) -> Make:
    """Another base, and its DBC file."""

    def make(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.change((SERIAL_WHEELS, section))
        if dbc is not None:
            (setup.folder / "base.dbc").write_text(dbc)

    return make


def key(content: str | bytes, mode: int = 0o600) -> Make:
    """Another team key."""

    def make(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.key.write_bytes(content if isinstance(content, bytes) else content.encode())
        setup.key.chmod(mode)

    return make


def without(package: str, then: Make) -> Make:
    """A package that is not installed."""

    def make(setup: Setup, patch: pytest.MonkeyPatch) -> None:
        then(setup, patch)
        for name in [n for n in sys.modules if n.split(".")[0] == package]:
            patch.delitem(sys.modules, name)
        patch.setitem(sys.modules, package, None)

    return make


def _configuration() -> list[Fault]:
    def no_file(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.config.unlink()

    def folder(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.config.unlink()
        setup.config.mkdir()

    def binary(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.config.write_bytes(b"\xff\xfe")

    def unreadable(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.config.chmod(0)

    return [
        Fault("no file", no_file, "No such file or directory", "make one: drslamd init -c "),
        Fault("a folder", folder, "Is a directory", "name a file"),
        Fault("no text", binary, "not a text file", "name a TOML file"),
        Fault("not to be read", unreadable, "Permission denied", "chmod u+rX", as_nobody=True),
        Fault("no TOML", changed("[uwb]", "[uwb"), "not valid TOML", "line"),
        Fault("id too large", changed("id = 3", "id = 255"), "robot.id = 255", "at most 254"),
        Fault("id below zero", changed("id = 3", "id = -1"), "robot.id = -1", "at least 0"),
        Fault("id as text", changed("id = 3", 'id = "3"'), "robot.id = '3'", "a whole number"),
        Fault("no id", changed("id = 3", ""), "robot.id: missing", "a whole number"),
        Fault("section misspelt", changed("[robot]", "[robt]"), "robt = ", "did you mean robot?"),
        Fault("key misspelt", changed('port = "UWB"', 'prt = "UWB"'), "uwb.prt", "mean port?"),
        Fault("foreign key", changed("[uwb]", "[uwb]\nqzx = 1"), "uwb.qzx", "allowed are port"),
        Fault("no source", changed('source = "kobuki"\n', ""), "wheels.source: missing", "allowed"),
        Fault("source misspelt", changed("source", "sorce"), "wheels.sorce", "mean source?"),
        Fault("no such base", changed('"kobuki"', '"kabuki"'), "'kabuki'", '"kobuki", "roboteq"'),
        Fault("no key named", changed('key_file = "team.key"', ""), "neither", "drslamd keygen"),
        Fault("key and none", changed("[team]", "[team]\ninsecure = true"), "exclude", "leave out"),
        Fault("no group", changed("[gossip]", '[gossip]\ngroup = "10.0.0.1"'), "10.0.0.1", "224."),
        Fault(
            "no scale",
            wheels(CAN + COUNTS.replace("counts_per_metre = 1000\n", "")),
            "measures",
            "needs counts_per_metre",
        ),
        Fault(
            "control character", changed('"UWB"', '"/dev/\\u0000"'), "uwb.port", "without control"
        ),
    ]


def _team_key() -> list[Fault]:
    def no_file(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.key.unlink()

    def folder(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.key.unlink()
        setup.key.mkdir()

    def pipe(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.key.unlink()
        os.mkfifo(setup.key)

    def closed_folder(setup: Setup, _: pytest.MonkeyPatch) -> None:
        closed = setup.folder / "closed"
        closed.mkdir(0o755)
        setup.key.rename(closed / "team.key")
        setup.change(('"team.key"', '"closed/team.key"'))
        closed.chmod(0)

    def foreign(setup: Setup, _: pytest.MonkeyPatch) -> None:
        if os.getuid():
            setup.key.chmod(0)
        else:
            os.chown(setup.key, 0, 0)

    path, keygen = "team.key_file = ", "drslamd keygen "
    return [
        Fault("key missing", no_file, f"{path}'", keygen),
        Fault("key a folder", folder, "not a plain file", "name a file"),
        Fault("key a pipe", pipe, "not a plain file", "name a file"),
        Fault("key 0644", key(SECRET, 0o644), "mode 0644 lets others read it", "chmod 600 "),
        Fault("key 0640", key(SECRET, 0o640), "mode 0640 lets others read it", "chmod 600 "),
        Fault("key of root", foreign, "Permission denied", "ch", as_nobody=True),
        Fault("key's folder", closed_folder, "Permission denied", "/closed", as_nobody=True),
        Fault("key empty", key(""), "not a team key", keygen),
        Fault("key cut off", key(SECRET[:-1]), "not a team key", keygen),
        Fault("key with letters", key("x" * len(SECRET)), "not a team key", keygen),
        Fault("key binary", key(b"\xff" * 32), "not a text file", keygen),
    ]


def _packages() -> list[Fault]:
    liblcm = changed("[gossip]", '[gossip]\nprovider = "liblcm"')
    return [
        Fault(
            "no python-can",
            without("can", wheels(AGILEX)),
            "python-can is not installed",
            'pip install "drslamd[can]"',
        ),
        Fault("no cantools", without("cantools", wheels(CAN + COUNTS)), "cantools", "pip install"),
        Fault("no lcm", without("lcm", liblcm), 'gossip.provider = "liblcm"', "pip install lcm"),
    ]


def _dbc() -> list[Fault]:
    def unreadable(setup: Setup, patch: pytest.MonkeyPatch) -> None:
        wheels(CAN + COUNTS)(setup, patch)
        (setup.folder / "base.dbc").chmod(0)

    def misspelt(old: str, new: str) -> Make:
        return wheels(CAN + COUNTS.replace(old, new))

    short = COUNTS.replace("Wheels.", "Short.")
    narrow = wheels(CAN + short + "counter_bits = 32\n")
    one_node = wheels(CAN + COUNTS + "left_node = 1\nid_mask = 31\n")
    return [
        Fault("no DBC", wheels(CAN + COUNTS, dbc=None), "base.dbc': No such", "correct the path"),
        Fault("DBC unreadable", unreadable, "Permission denied", "ch", as_nobody=True),
        Fault("no DBC text", wheels(CAN + COUNTS, dbc="hello"), "not a DBC file", "line"),
        Fault(
            "message misspelt",
            misspelt("Wheels.Left", "Weels.Left"),
            "no message Weels",
            "there are Wheels",
        ),
        Fault(
            "signal misspelt",
            misspelt("Wheels.Right", "Wheels.Rigth"),
            "no signal Rigth",
            "there are Left, Right",
        ),
        Fault("signal narrow", narrow, "has only 16 bits", "counter_bits = 32"),
        Fault("one node", one_node, "left_node", "give both"),
    ]


def calibrated(content: str | None, mode: int = 0o644) -> Make:
    """A calibration that the configuration names."""

    def make(setup: Setup, _: pytest.MonkeyPatch) -> None:
        setup.change(("id = 3", 'id = 3\ncalibration = "3.cal"'))
        if content is not None:
            (setup.folder / "3.cal").write_text(content)
            (setup.folder / "3.cal").chmod(mode)

    return make


def _calibration() -> list[Fault]:
    def pipe(setup: Setup, patch: pytest.MonkeyPatch) -> None:
        calibrated(None)(setup, patch)
        os.mkfifo(setup.folder / "3.cal")

    own = "robot.id = 3\n"
    other_track = f"{own}wheels.track_m = 0.25\npush = {{scale = 0.1, sigma = 0.01}}\n"
    measure = "drslamd calibrate"
    return [
        Fault("no calibration", calibrated(None), "3.cal': No such file", measure),
        Fault("calibration a pipe", pipe, "no plain file", measure),
        Fault("another's calibration", calibrated("robot.id = 4\n"), "it is of robot 4", measure),
        Fault("other wheels", calibrated(other_track), "it was measured with wheels.", measure),
        Fault("no calibration's text", calibrated("hello"), "not valid TOML", "measure anew"),
        Fault("calibration closed", calibrated(own, 0), "Permission denied", "ch", as_nobody=True),
    ]


def faults_that_are_refused() -> list[Fault]:
    """Those with which `run` does not start."""

    def no_home(setup: Setup, patch: pytest.MonkeyPatch) -> None:
        setup.change(('state_dir = "STATE"\n', ""))
        patch.setenv("HOME", "")
        patch.delenv("STATE_DIRECTORY", raising=False)
        patch.delenv("RUNTIME_DIRECTORY", raising=False)

    no_home_fault = Fault("no home", no_home, "HOME is not set", "daemon.state_dir")
    return [*_configuration(), *_team_key(), *_packages(), *_dbc(), *_calibration(), no_home_fault]
