"""``drslamd calibrate``: what a tape knows of wheels and antennas, and driving learns late."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drslamd.cli.exit_codes import (
    ALREADY_RUNS,
    BAD_CONFIG,
    CANNOT_CREATE,
    FOUND,
    OK,
    UNAVAILABLE,
    USAGE,
)
from drslamd.cli.parser import Verbs, configured_verb, load
from drslamd.config import Config
from drslamd.conventions import MAX_ROBOT_ID

if TYPE_CHECKING:
    from drslamd.setup.calibration_file import Taped

STEPS = ("push", "turn", "apart")
USUAL_METRES = {"push": 1.0, "apart": 3.0}
MOST_METRES, MOST_TURNS, MOST_SECONDS = 50.0, 20.0, 600.0
WAY_OUT = "try sudo, or another -o"
EXAMPLES = """\
  drslamd calibrate -c /etc/drslamd/3.toml                     push and turn, one after the other
  drslamd calibrate push -c /etc/drslamd/3.toml --metres 2.0   scale and sign of both wheels
  drslamd calibrate turn -c /etc/drslamd/3.toml --turns 3      track, left and right
  drslamd calibrate apart -c /etc/drslamd/3.toml --peer 4 --metres 3.0   bias of two antennas"""


def add(verbs: Verbs) -> None:
    """Add the verb."""
    calibrate = configured_verb(
        verbs,
        "calibrate",
        _calibrate,
        "measure wheels and antennas with a tape, on a robot whose daemon is stopped",
        EXAMPLES,
    )
    calibrate.add_argument("step", nargs="?", choices=STEPS, help="default: push, then turn")
    calibrate.add_argument(
        "--metres", type=float, metavar="M", help="by the tape (default: push 1, apart 3)"
    )
    calibrate.add_argument("--turns", type=float, default=1.0, metavar="N", help="default: 1")
    calibrate.add_argument("--peer", type=int, metavar="N", help="the other robot.id, for apart")
    calibrate.add_argument(
        "--peer-uwb", type=int, metavar="N", help="id of its module, if not its robot.id"
    )
    calibrate.add_argument(
        "--within", type=float, default=120.0, metavar="S", help="longest wait (default: 120 s)"
    )
    calibrate.add_argument(
        "-o", "--output", metavar="FILE", help="default: robot.calibration, or beside the TOML file"
    )
    calibrate.add_argument("--json", action="store_true", help="results as JSON")


def _calibrate(options: argparse.Namespace) -> int:
    config = load(options.config)
    if wrong := _wrong_usage(options, config):
        return _fail(wrong, USAGE)
    from drslamd.cli.setting_up.calibration_steps import MEASURES
    from drslamd.cli.setting_up.measuring import NotMeasured, Why
    from drslamd.cli.setting_up.writing import write_whole
    from drslamd.setup import calibration_file
    from drslamd.setup.taped_steps import Mistake

    path = _output(options, config)
    if not os.access(path.parent, os.W_OK):
        return _fail(f"{path.parent}: nothing can be written there; {WAY_OUT}", CANNOT_CREATE)
    try:
        taped = _so_far(path, config)
    except calibration_file.UnusableCalibration as error:
        return _fail(f"{path}: {error}", BAD_CONFIG)
    results: list[dict[str, Any]] = []
    code, said = OK, ""
    for step in [options.step] if options.step else ["push", "turn"]:
        try:
            done = MEASURES[step](options, config, taped)
        except KeyboardInterrupt:
            return _fail(f"{step}: interrupted; what was measured before is kept", FOUND)
        if isinstance(done, (NotMeasured, Mistake)):
            said = f"{step}: {done.sentence}"
            busy = isinstance(done, NotMeasured) and done.why is Why.BUSY
            is_port = isinstance(done, NotMeasured) and done.why is not Why.TIME
            code = ALREADY_RUNS if busy else UNAVAILABLE if is_port else FOUND
            break
        taped, numbers, lines = done
        results.append({"step": step, **numbers})
        try:
            write_whole(path, calibration_file.text(taped), may_replace=True)
        except OSError as error:
            code, said = CANNOT_CREATE, f"{path}: {error.strerror}; {WAY_OUT}"
            break
        if not options.json:
            print("\n".join(lines), flush=True)
    if options.json:
        print(json.dumps({"file": str(path), "steps": results, "fault": said}, indent=2))
    if said:
        return _fail(said, code)
    if not options.json:
        _tell(path, config, taped)
    return code


def _wrong_usage(options: argparse.Namespace, config: Config) -> str:
    """One sentence, empty if all can be meant."""
    if options.step is None and options.metres is not None:
        return "--metres needs its step: drslamd calibrate push --metres M"
    if options.metres is None:
        options.metres = USUAL_METRES.get(options.step, USUAL_METRES["push"])
    for flag, value, most in (
        ("--metres", options.metres, MOST_METRES),
        ("--turns", options.turns, MOST_TURNS),
        ("--within", options.within, MOST_SECONDS),
    ):
        if not 0.1 <= value <= most:
            return f"{flag} {value:g}: 0.1 to {most:g}"
    if options.step != "apart":
        return ""
    if options.peer is None or not 0 <= options.peer <= MAX_ROBOT_ID:
        return f"--peer: the id of the other robot, 0 to {MAX_ROBOT_ID}"
    own = config.robot.id
    if options.peer == own:
        return f"--peer {own}: that is this robot"
    if options.peer < own:
        return (
            f"--peer {options.peer}: the robot with the lower id uses the bias of a pair; measure "
            f"on robot {options.peer}, with --peer {own}"
        )
    return ""


def _output(options: argparse.Namespace, config: Config) -> Path:
    beside = Path(options.config).resolve().parent / f"{config.robot.id}.calibration.toml"
    return Path(options.output or config.robot.calibration or beside)


def _so_far(path: Path, config: Config) -> Taped:
    """What the file says already.

    Raises:
        UnusableCalibration: it is another robot's, or none of ours.
    """
    from drslamd.parts import read_taped
    from drslamd.setup.calibration_file import Taped, UnusableCalibration

    taped = read_taped(path)
    if taped is None:
        return Taped(config.robot.id)
    if taped.robot != config.robot.id:
        raise UnusableCalibration(
            f"it is of robot {taped.robot}, not {config.robot.id}; name another with -o"
        )
    return taped


def _tell(path: Path, config: Config, taped: Taped) -> None:
    from drslamd.setup.wheel_scales import keys_instead

    print(f"{path}: written")
    scale, turn = (learned and learned.value for learned in (taped.push, taped.turn))
    if instead := keys_instead(config.wheels, scale, turn):
        print(f"  (the same without the file: {', '.join(instead)})")
    if Path(config.robot.calibration or "/") != path.resolve():
        print(f'next: set robot.calibration = "{path}", then start the daemon')
    else:
        print("next: start the daemon")


def _fail(sentence: str, code: int) -> int:
    print(f"drslamd calibrate: {sentence}", file=sys.stderr)
    return code
