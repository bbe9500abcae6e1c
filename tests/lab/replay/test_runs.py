"""Files by run: what belongs together, what is missing, what is no recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import lcm
import pytest
from lab.recordings.recording import BadRecording
from lab.replay.runs import is_recording, key_of, make_robot, read_runs

from drslamd.config import parse
from drslamd.events import SerialData
from drslamd.gossip.seal import team_key
from drslamd.io.recording.log_files import file_name
from drslamd.io.recording.provenance import provenance
from drslamd.recording.encoder import Encoder
from drslamd.recording.records import Beginning, Opening, Record, Told

EPOCH = 1_795_745_745_123_456
SECRET = bytes(range(32))
TOML = """
[robot]
id = {robot}
[team]
{team}
[uwb]
port = "/dev/uwb"
[wheels]
source = "kobuki"
port = "/dev/wheels"
"""


def write(
    folder: Path,
    robot: int = 3,
    epoch: int = EPOCH,
    parts: int = 1,
    team: str = "insecure = true",
    key: bytes = b"",
) -> list[Path]:
    """A run of some files, each with two events."""
    config = parse(TOML.format(robot=robot, team=team))
    origin = provenance(config, "", key or team_key(None))
    encoder, out = Encoder(robot, True), []
    for part in range(parts):
        data = encoder.opening(Opening(100 * part, Beginning(epoch), part, origin))
        for k in range(2):
            data += encoder.event(SerialData(100 * part + k, "uwb", b"%d %d" % (part, k)))
        out.append(folder / file_name(robot, epoch, part))
        out[-1].write_bytes(data)
    return out


def events(records: list[Record]) -> list[bytes]:
    return [r.data for r in records if isinstance(r, SerialData)]


def gaps(records: list[Record]) -> int:
    return sum(isinstance(r, Told) and r.kind == "gap" for r in records)


def test_files_of_one_start_are_one_run_in_order(tmp_path: Path) -> None:
    write(tmp_path, 3, parts=3)
    write(tmp_path, 3, EPOCH + 9)
    write(tmp_path, 1)
    runs = read_runs([tmp_path])
    assert [(run.robot, len(run.files)) for run in runs] == [(1, 1), (3, 3), (3, 1)]
    records = list(runs[1].records())
    assert events(records) == [b"0 0", b"0 1", b"1 0", b"1 1", b"2 0", b"2 1"]
    assert (gaps(records), runs[1].said) == (0, [])
    assert runs[1].length_s() == pytest.approx(201e-6)
    assert all(run.is_whole for run in runs)


def test_folders_of_each_robot_in_one_folder_are_found(tmp_path: Path) -> None:
    for robot in (1, 2):
        (tmp_path / str(robot)).mkdir()
        write(tmp_path / str(robot), robot)
    assert [run.robot for run in read_runs([tmp_path])] == [1, 2]
    assert is_recording(tmp_path)
    assert is_recording(tmp_path / "1")
    assert is_recording(next((tmp_path / "2").iterdir()))
    assert not is_recording(Path(__file__))


def test_a_file_of_any_name_can_be_given_alone(tmp_path: Path) -> None:
    (path,) = write(tmp_path)
    other = path.rename(tmp_path / "copy.log")
    (run,) = read_runs([other])
    assert run.robot == 3


def test_a_part_that_is_missing_is_a_gap_that_is_said(tmp_path: Path) -> None:
    paths = write(tmp_path, parts=4)
    paths[1].unlink()
    (run,) = read_runs([tmp_path])
    records = list(run.records())
    assert events(records) == [b"0 0", b"0 1", b"2 0", b"2 1", b"3 0", b"3 1"]
    assert gaps(records) == 1
    assert run.said == [f"{paths[2].name}: part 1 is missing before it"]
    paths[0].unlink()
    (run,) = read_runs([tmp_path])
    assert not run.is_whole
    assert gaps(list(run.records())) == 0


@pytest.mark.parametrize(("part", "gap"), [(0, 1), (1, 0)])
def test_a_tail_that_is_cut_is_a_gap_unless_nothing_comes_after_it(
    tmp_path: Path, part: int, gap: int
) -> None:
    paths = write(tmp_path, parts=2)
    paths[part].write_bytes(paths[part].read_bytes()[:-1])
    (run,) = read_runs([tmp_path])
    records = list(run.records())
    assert gaps(records) == gap
    assert len(events(records)) == 3
    assert run.said[0].startswith(paths[part].name)
    assert ("the end is cut" in run.said[0]) is (part == 1)


def test_what_is_no_recording_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(BadRecording, match=r"no robot-\*\.lcmlog in it"):
        read_runs([tmp_path])
    with pytest.raises(BadRecording, match="No such file"):
        read_runs([tmp_path / "none.lcmlog"])
    (tmp_path / "empty").touch()
    with pytest.raises(BadRecording, match="there is no entry in it"):
        read_runs([tmp_path / "empty"])
    log = lcm.EventLog(str(tmp_path / "other"), "w", overwrite=True)
    log.write_event(1, "POSE", b"x")
    log.close()
    with pytest.raises(BadRecording, match="no recording of drslamd: another LCM log"):
        read_runs([tmp_path / "other"])


def key_file(folder: Path, secret: bytes) -> str:
    path = folder / f"{secret[0]}.key"
    path.write_text(secret.hex())
    path.chmod(0o600)
    return str(path)


def test_a_run_with_a_team_key_needs_that_key(tmp_path: Path) -> None:
    write(tmp_path, team='key_file = "/none/team.key"', key=SECRET)
    (run,) = read_runs([tmp_path])
    with pytest.raises(BadRecording, match="made with a team key, which no recording holds; give"):
        key_of(run, None)
    with pytest.raises(BadRecording, match="is not the team key that robot 3"):
        key_of(run, key_file(tmp_path, bytes([9] * 32)))
    assert key_of(run, key_file(tmp_path, SECRET)) == SECRET


def test_a_run_without_a_key_needs_none(tmp_path: Path) -> None:
    write(tmp_path)
    assert key_of(read_runs([tmp_path])[0], None) == team_key(None)


def test_a_configuration_of_another_version_is_one_sentence(tmp_path: Path) -> None:
    write(tmp_path)
    (run,) = read_runs([tmp_path])
    run.opening.provenance["configuration"]["robot"]["colour"] = "red"
    with pytest.raises(BadRecording, match="its configuration"):
        run.config()


@pytest.mark.parametrize(
    ("state", "scale"),
    [({"scale": [0.02, 0.006]}, 0.02), ({"scale": [9.0, 0.006]}, 0.0), ("no table", 0.0)],
)
def test_a_robot_is_made_with_what_a_tape_said_then(
    tmp_path: Path, state: object, scale: float
) -> None:
    write(tmp_path)
    (run,) = read_runs([tmp_path])
    named = run.config().robot.model_copy(update={"calibration": "3.calibration.toml"})
    config = run.config().model_copy(update={"robot": named})
    origin = {**run.opening.provenance, "taped": state}
    run.opening = replace(run.opening, provenance=origin)
    robot = make_robot(config, run, team_key(None))
    assert robot.calibration.used.scale.value == scale
    # a configuration that names no file asks what would have been without it
    assert make_robot(run.config(), run, team_key(None)).calibration.used.scale.value == 0.0


@pytest.mark.parametrize(
    ("state", "is_known"),
    [
        ({"speed_mps": 0.5, "seen": [[1, 7, 120, 9, 1.5, -2.0, 0.2]]}, True),
        ({}, False),
        ([], False),
    ],
)
def test_a_robot_is_made_with_where_its_last_start_was(
    tmp_path: Path, state: object, is_known: bool
) -> None:
    write(tmp_path)
    (run,) = read_runs([tmp_path])
    begun = replace(run.opening.beginning, place=state)  # type: ignore[arg-type]
    robot = make_robot(run.config(), run, team_key(None), begun)
    assert robot.front.resumption.is_waiting is is_known
