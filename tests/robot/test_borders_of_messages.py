"""A member lies about every number of every message: only what it says of itself is damaged."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from borders import LIAR, Lie, lies, spoken
from lab.recordings import world
from snapshots import plain
from teams import EASY, VirtualTeam

from drslamd.conventions import SECOND_US
from drslamd.events import Datagram, Save, Stop
from drslamd.gossip import lc02, messages
from drslamd.gossip.message_types import Message
from drslamd.gossip.seal import Header, team_key
from drslamd.io.state_store import StateStore, is_sound
from drslamd.robot import Robot

LONG = world.Scene(**{**EASY.__dict__, "seconds": 80.0})


def like_those_of(team: VirtualTeam) -> dict[str, Message]:
    """What the liar said last of each kind, and what it could have said."""
    _, like = spoken()
    for _, channel, payload in team.member(LIAR).traces.sent:
        kind = messages.kind_of_channel(channel)
        assert kind is not None
        message = messages.decode(kind, payload)
        assert not isinstance(message, str)
        like[kind] = message
    return like


def told(team: VirtualTeam) -> list[Lie]:
    member = team.member(LIAR)
    utime = member.clock.local(team.simulator.now)
    seal = member.robot.team.seal
    header = Header(3, LIAR, seal.epoch, seal._counter + 1, utime)
    return list(lies(header, team_key(None), like_those_of(team)))


def tell(team: VirtualTeam, robot: int, lies: list[Lie]) -> None:
    member = team.member(robot)
    utime = member.clock.local(team.simulator.now)
    for number, (name, channel, payload) in enumerate(lies):
        try:
            effects = member.robot.handle(Datagram(utime, lc02.encode(number, channel, payload)))
        except Exception as error:
            raise AssertionError(name) from error
        assert effects == [], name


def of_the_others(robot: Robot) -> Any:
    """All that a robot knows of itself and of robot 1, as values."""
    graph, others = robot.back.graph, (0, 1)
    held = {r: robot.team.logs._logs[r] for r in others}
    # of what is held of a log everybody may have heard more
    logs = {r: (log.sealed.copy(), log.first, log.start, log.complete) for r, log in held.items()}
    chains = {r: (graph.chains[r].chain, graph.chains[r].keyframes.rows.tobytes()) for r in others}
    pairs = {
        key: (pair.ranges.rows.tobytes(), plain(pair.closures))
        for key, pair in graph.pairs.items()
        if LIAR not in key
    }
    peer = robot.team.peers[1]
    known = plain({**vars(peer), "track": peer.track.poses.tobytes()})
    own = robot.own, robot.front.reckoning.track.poses.tobytes(), robot.calibration.latest
    return logs, chains, pairs, known, own, robot.team.seal.epochs[1]


def kept_by(team: VirtualTeam, robot: int, folder: Path) -> dict[str, Any]:
    """What a robot keeps at its end, through the file."""
    member = team.member(robot)
    effects = member.robot.handle(Stop(member.clock.local(team.simulator.now)))
    (save,) = (effect for effect in effects if isinstance(effect, Save))
    team.simulator.kill(member)
    StateStore(folder, robot).save(save.state)
    store = StateStore(folder, robot)
    state = store.load()
    assert store.fault == ""
    return state


def is_well(team: VirtualTeam) -> bool:
    """Does everybody hear everybody?"""
    return all(
        len(m.robot.team.living(m.clock.local(team.simulator.now))) == 2
        for m in team.simulator.members.values()
    )


def battered(team: VirtualTeam, folder: Path, later_s: float) -> None:
    """Lie to robots 0 and 1, let them go on, and let robot 0 begin again from its file."""
    lies = told(team)
    assert len(lies) > 700
    for robot in (0, 1):
        before = of_the_others(team.member(robot).robot) if robot == 0 else None
        tell(team, robot, lies)
        assert robot or of_the_others(team.member(robot).robot) == before
    now = team.simulator.now / SECOND_US
    team.run(now + later_s)
    assert is_well(team)
    state = kept_by(team, 0, folder)
    team.run(now + later_s + 4)
    epoch = StateStore(folder, 0).begin(state, state["epoch"])
    epochs = {int(robot): start for robot, start in state["epochs"].items()}
    assert epochs.keys() == {1, 2}
    team.start(0, epoch, epochs)
    team.run(now + 2 * later_s + 4)
    assert is_well(team)
    assert team.member(0).robot.own.epoch == epoch
    assert all(is_sound(json.loads(json.dumps(m.robot.memory.state()))) for m in members(team))


def members(team: VirtualTeam) -> list[Any]:
    return list(team.simulator.members.values())


def test_a_team_that_has_just_met_survives_every_number_at_its_borders(tmp_path: Path) -> None:
    team = VirtualTeam()
    team.run(6.0)
    battered(team, tmp_path, later_s=10.0)


@pytest.mark.slow
# a path of nonsense has no sigma; that its numbers overflow in the solver is no exception
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("algorithm", ["banded", "rbcd", "closures"])
def test_a_team_that_is_localised_survives_every_number_at_its_borders(
    tmp_path: Path, algorithm: str
) -> None:
    team = VirtualTeam(LONG, extra=f'[optimizer]\nalgorithm = "{algorithm}"\n')
    team.run(40.0)
    assert set(team.frames().values()) == {0}
    battered(team, tmp_path, later_s=15.0)
