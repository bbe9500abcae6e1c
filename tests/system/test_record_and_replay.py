"""Three real daemons record; what they decided is decided again, to the bit."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import lcm
import pytest
from lab.play.playback import equip
from lab.play.real_team import RealTeam
from lab.recordings import world
from lab.replay.exact import Replayer
from lab.replay.runs import Run, key_of, read_runs
from machine_speed import allowed_s
from namespace import hindrance
from places import REPOSITORY, Recorded

from drslamd.events import Effect, Event, Stop
from drslamd.gossip import messages
from drslamd.gossip.message_types import Pose, PoseState
from drslamd.io.recording.log_files import LogFiles
from drslamd.io.recording.recorder import Recorder
from drslamd.io.status_socket import ask
from drslamd.recording.encoder import Encoder
from drslamd.recording.event_log import Entry, entries
from drslamd.recording.records import Beginning, Sent
from drslamd.robot import GOODBYES

pytestmark = pytest.mark.slow

SCENE = world.Scene(robots=3, seconds=40.0)
KILLED, KILLED_AT_S = 1, 14.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What three daemons recorded, of whom one was killed and started again."""
    folder = tmp_path_factory.mktemp("recorded")
    recording = world.simulate(SCENE, 1)
    extra = f'record = true\nrecord_dir = "{folder}"\n'

    async def run() -> None:
        hardware = equip(recording, varied=True)
        async with RealTeam(recording, hardware, extra) as team:
            kill = asyncio.ensure_future(kill_and_start(team))
            await team.play()
            await kill
            for robot in team.robots.values():
                said = await ask(robot.socket, "status")
                assert said["recording"]["fault"] == ""
                assert said["recording"]["events_lost"] == 0

    asyncio.run(asyncio.wait_for(run(), 120))
    return folder


async def kill_and_start(team: RealTeam) -> None:
    await asyncio.sleep(KILLED_AT_S)
    robot = team.robots[KILLED]
    process, robot.process = robot.process, None
    assert process is not None
    process.kill()
    await process.wait()
    await robot.start()


@pytest.fixture(scope="module")
def runs(folder: Path) -> list[Run]:
    return read_runs([folder])


def test_every_run_is_there(runs: list[Run]) -> None:
    assert [run.robot for run in runs] == [0, KILLED, KILLED, 2]
    lengths = [run.length_s() for run in runs]
    assert min(lengths[0], lengths[3]) > SCENE.seconds
    for run in (runs[0], runs[2], runs[3]):
        # ended in order: the goodbyes are on the disk too
        records = list(run.records())
        (stop,) = (i for i, record in enumerate(records) if isinstance(record, Stop))
        assert sum(isinstance(record, Sent) for record in records[stop:]) >= GOODBYES
        assert run.said == []
    # at most the last second was not on the disk yet, and starting takes some
    assert KILLED_AT_S - 6 < lengths[1] < KILLED_AT_S + 6


def test_all_of_them_decide_the_same_again_and_much_faster(runs: list[Run]) -> None:
    seconds, began = 0.0, time.process_time()
    for run in runs:
        found = Replayer(run, key_of(run, None)).follow()
        assert (found.difference, found.ended) == (None, ""), run.name
        assert found.sends > 10
        seconds += found.seconds
    took = time.process_time() - began
    assert took < allowed_s(seconds / 10)
    assert found.robot.back.estimate is not None


def test_so_does_one_whose_file_was_cut(runs: list[Run], tmp_path: Path) -> None:
    (path,) = runs[0].files
    whole = path.read_bytes()
    (tmp_path / path.name).write_bytes(whole[: len(whole) * 2 // 3 + 5])
    (run,) = read_runs([tmp_path])
    found = Replayer(run, key_of(run, None)).follow()
    assert found.difference is None
    assert found.seconds > 15


def test_the_lcm_package_reads_the_poses_that_were_published(runs: list[Run]) -> None:
    """As lcm-spy and lcm-logplayer do."""
    (path,) = runs[2 + 1].files
    states = []
    log = lcm.EventLog(str(path), "r")
    for event in log:
        if event.channel == "DRSLAM_POSE_002":
            message = messages.decode("POSE", event.data)
            assert isinstance(message, Pose)
            states.append(message.state)
    log.close()
    assert states.count(PoseState.LOCALISED) > 5


@pytest.mark.row("O10")
def test_recording_costs_less_than_a_hundredth_of_a_core(
    runs: list[Run], tmp_path: Path, record_property: Recorded
) -> None:
    """All events and answers of a run once more into a recorder, and onto the disk."""
    replayer, happened = Replayer(runs[0], key_of(runs[0], None)), []
    handle = replayer.found.robot.handle

    def noted(event: Event) -> list[Effect]:
        effects = handle(event)
        happened.append((event, effects))
        return effects

    replayer.found.robot.handle = noted  # type: ignore[method-assign]
    seconds = replayer.follow().seconds
    recorder = Recorder(LogFiles(tmp_path, 0, 1 << 30), Encoder(0, True), {}, dict)
    recorder.begin(1, Beginning(1))
    began = time.process_time()
    for event, effects in happened:
        recorder.event(event)
        recorder.effects(event.utime, effects)
    recorder._flush()
    took = time.process_time() - began
    recorder._files.close()
    assert len(happened) > 1_500
    assert took < allowed_s(0.01 * seconds)
    record_property("measured", f"recording takes {100 * took / seconds:.2f} % of a core")


def test_lcm_logplayer_plays_the_file_and_drslamd_record_hears_it(
    runs: list[Run], tmp_path: Path
) -> None:
    player = Path(sys.executable).parent / "lcm-logplayer"
    if hindrance() or not player.exists():
        pytest.skip(hindrance() or f"no {player}: pip install lcm")
    (path,) = runs[3].files
    heard = tmp_path / "heard.lcmlog"
    listen = f"{sys.executable} -m drslamd record {heard} --interface 127.0.0.1 --port 17667"
    play = f"{player} -l 'udpm://239.255.76.67:17667?ttl=0' --speed=10 {path}"
    script = (
        "ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo\n"
        f"{listen} > {tmp_path}/said 2>/dev/null & \n"
        f"while [ ! -e {heard} ]; do sleep 0.1; done\n"
        f"{play} && kill -INT $! && wait $!"
    )
    command = ["unshare", "-rn", "sh", "-c", script]
    subprocess.run(command, check=True, timeout=60, cwd=REPOSITORY, capture_output=True)
    with path.open("rb") as file:
        wanted = Counter(e.channel for e in entries(file) if isinstance(e, Entry))
    lines = (tmp_path / "said").read_text().splitlines()
    said = {line[9:]: int(line[:8]) for line in lines if " DRSLAM" in line}
    assert said["DRSLAM_POSE_002"] == wanted["DRSLAM_POSE_002"] > 5
    assert said == {name: n for name, n in wanted.items() if name.startswith("DRSLAM")}
