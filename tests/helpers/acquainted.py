"""Robots that have answered each other, without the statuses in which they say so."""

from __future__ import annotations

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage
from drslamd.gossip.message_types import Received
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team


def introduce(team: Team, *chains: Chain | Seal, utime: int = 0) -> Team:
    """The team, to which these starts have answered."""
    for chain in chains:
        start = Chain(chain.robot, chain.epoch)
        known = team.peers.get(start.robot)
        if known is None or known.chain != start:
            team.meet(start, 0, utime)
    return team


def told(team: Team, seal: Seal, message: tuple[str, bytes], utime: int) -> Received | None:
    """A robot that has answered says something."""
    introduce(team, seal, utime=utime)
    return team.receive(ChannelMessage(utime, *message))
