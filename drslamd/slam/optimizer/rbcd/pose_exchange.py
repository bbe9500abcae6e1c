"""Who may move, and what must be said: block descent over a network that loses messages.

Robots that move at once, each on poses that the other is about to leave, may both be right and the
team worse off. So neighbours, robots that share a closure, take turns: who has moved waits until
the other has moved from there. Then every move is made on the very poses that the neighbours have,
and what it gains is gained by the whole team, whatever was lost or late on the way.

Nobody hands out turns. A move gets a number above those of all neighbours' last moves (Lamport
1978); it is the turn of the robot that knows of each neighbour a move with a number above its own
last. For such a neighbour cannot have moved again: it would first have to hear a higher number of
ours. The lowest number of all may always move, so nobody ever waits in a circle.

Who would move and lacks a neighbour's move asks; the neighbour says it again, or, if it has no
reason to move, moves to where it is. One that lives and does not answer for long is left alone.
So a move of the neighbours with a higher number also says that they hold ours; who does not hear
one asks, and who learns by a question what it has missed asks back. Then there is silence.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from dataclasses import replace

import numpy as np

from drslamd.conventions import MILLISECOND_US, SECOND_US, Chain
from drslamd.slam.graph.estimate import Lifted
from drslamd.slam.graph.public_poses import MAX_HELD, HeardPoses, PublicPoses
from drslamd.slam.se2 import Array

PATIENCE_US = 5 * SECOND_US
"""A neighbour that lives and does not answer for so long has another trouble; at 50 % loss it was
asked a hundred times."""
ASK_US = 40 * MILLISECOND_US
"""How long a turn is waited for until it is asked for, and asked again ..."""
ASK_LATER_US = SECOND_US
"""... which is rarer when nobody answers: no neighbour is in the frame yet."""
REPEAT_US = 30 * MILLISECOND_US
"""Between two repetitions of what somebody lost: all that ask meanwhile hear the same one."""
MOST_QUESTIONS = 30
"""Who has not answered so many of them about one move does not know our frame, or anything."""
LEAP = 2**24
"""A number goes up by no more at once, so that none from outside brings it to its limit of 2^62."""
MATTERS = 1e-10
"""Change of a pose, squared and in units of what closures tell of it, that is worth being said: a
hundred-thousandth of their sigma, which is what 32 bits can say of a place 10 m away."""


class PoseExchange:
    """One robot's part in it.

    Attributes:
        round: number of our last move; 0 of none.
        is_waiting: would we move, and is it not our turn?
        news: how often a neighbour was found to be elsewhere than before.
    """

    def __init__(self, own: Chain) -> None:
        self._own = own
        self.round = 0
        self.is_waiting = False
        self.news = 0
        self._heard: dict[Chain, HeardPoses] = {}
        self._neighbours: list[Chain] = []
        self._said: PublicPoses | None = None
        self._said_in: dict[int, int] = {}
        """By keyframe: the move that its pose was last said with."""
        self._weights: dict[int, Array] = {}
        """By keyframe: how stiffly closures hold it, or did when it last carried any."""
        self._first = self._before = 0
        """The move before the first one in this frame, and that before the last one."""
        self._news_in = self._told_at = self._questions = 0
        """The last move that moved a pose, when it was said, and how often it was asked about."""
        self._blocked_since: dict[Chain, int] = {}
        self._asks_at = self._waits_since = 0
        self._lost: dict[Chain, int] = {}
        """Who asked to hear again what came after some move of ours."""
        self._repeated_at = 0
        self._is_awaited = False

    def hear(self, origin: Chain, message: PublicPoses) -> None:
        """A robot said where it is, or asks others to."""
        if origin not in self._heard:
            self.keep({chain for chain in self._heard if chain.robot != origin.robot})
            self._heard[origin] = HeardPoses()
        peer = self._heard[origin]
        self.news += peer.take(message)
        held = dict(message.held).get(self._own.robot)
        if not message.asks or held is None:
            return
        if held < self.round:
            self._lost[origin] = held
        elif (self.round, self._own) < (message.round, origin):
            self._is_awaited = True

    def keep(self, chains: Set[Chain]) -> None:
        """Forget all robots but these."""
        for chain in self._heard.keys() - chains:
            del self._heard[chain]
            self.news += 1
            self._lost.pop(chain, None)

    def held(self, frame: Chain | None = None) -> dict[int, PublicPoses]:
        """By robot: the poses that are held completely, those in one frame or in any."""
        return {
            chain.robot: peer.poses
            for chain, peer in self._heard.items()
            if peer.poses and frame in (None, (peer.poses.frame, peer.poses.frame_epoch))
        }

    def begin(self, neighbours: Iterable[Chain], utime: int) -> bool:
        """We would move: is it our turn?

        Args:
            neighbours: living robots that share closures with us.
        """
        self._neighbours = sorted(neighbours)[:MAX_HELD]
        blocked = [chain for chain in self._neighbours if not self._is_my_turn(chain)]
        self._blocked_since = {c: self._blocked_since.get(c, utime) for c in blocked}
        if any(utime - since < PATIENCE_US for since in self._blocked_since.values()):
            self.wait(utime)
            return False
        self.is_waiting = False
        return True

    def wait(self, utime: int) -> None:
        """We cannot move before we have heard more; if that takes long it is asked for."""
        if not self.is_waiting:
            self._asks_at, self._waits_since = utime + ASK_US, utime
        self.is_waiting = True

    def rest(self, utime: int) -> None:
        """We have no reason to move, unless we have missed one."""
        if self._lacks_any():
            self.wait(utime)
        else:
            self.is_waiting = False

    @property
    def is_at_rest(self) -> bool:
        """Will we be silent until we hear something?"""
        return not self.is_waiting and not self._is_unheard()

    def _is_my_turn(self, chain: Chain) -> bool:
        """Does this neighbour have to wait for us, and do we know where it is?"""
        peer = self._heard.get(chain)
        if peer is None or peer.newest == 0:
            # it was in no frame yet; once we have moved it has something to be placed by
            return self.round == 0
        return not peer.lacks and (self.round, self._own) < (peer.round, chain)

    def _lacks_any(self) -> bool:
        """Do we know of a neighbour's move that we do not hold?"""
        return any(self._heard[c].lacks for c in self._neighbours if c in self._heard)

    def _is_unheard(self) -> bool:
        """Is there a neighbour of which we do not know that it holds our poses?"""
        if not self._news_in or self._questions == MOST_QUESTIONS:
            return False
        newest = (self._heard[c].newest if c in self._heard else 0 for c in self._neighbours)
        return any(move <= self._news_in for move in newest)

    def moved(self, frame: Chain, lifted: Lifted, utime: int) -> list[PublicPoses]:
        """What of our new poses must be said; nothing when they hardly moved."""
        if not len(lifted.carriers):
            return []
        now = public_poses(frame, lifted, self._said_in)
        if self._said is None or (now.frame, now.frame_epoch) != (
            self._said.frame,
            self._said.frame_epoch,
        ):
            self._said, self._said_in, self._first = None, {}, self.round
            self._weights = {}
            now = public_poses(frame, lifted)
        before = self._said.table() if self._said else {}
        self._weights.update(zip(lifted.carriers.tolist(), lifted.weights, strict=True))
        news = _news(now, before, self._weights)
        if not news and not self._is_awaited:
            return []
        table = {**before, **now.chosen(news).table()}
        values = np.array([now.values[0], *(table[n] for n in now.keyframes)])
        self._said = replace(now, values=values)
        self._advance()
        if news:
            self._news_in, self._told_at, self._questions = self.round, utime, 0
        said = {**self._said_in, **dict.fromkeys(news, self.round)}
        self._said_in = {n: said[n] for n in now.keyframes}
        self._weights = {n: self._weights[n] for n in now.keyframes}
        return [self._after(self._before)]

    def _advance(self) -> None:
        """We moved, after all that the neighbours did."""
        highest = max(
            (self._heard[c].newest for c in self._neighbours if c in self._heard), default=0
        )
        self._before = self.round
        self.round = max(self.round, min(highest, self.round + LEAP)) + 1
        self._is_awaited = False

    def _after(self, move: int) -> PublicPoses:
        """All that was said anew after some move of ours."""
        assert self._said is not None
        since = move if move > self._first else 0
        chosen = self._said.chosen(n for n, said in self._said_in.items() if said > since)
        return replace(chosen.occupied(), round=self.round, since=since)

    def answers(self, utime: int, at_rest: bool) -> list[PublicPoses]:
        """What others wait for, and what we must ask for ourselves.

        Args:
            at_rest: we do not move now, nor would we.
        """
        out = []
        if self._said is not None and self._lost and utime - self._repeated_at >= REPEAT_US:
            out.append(self._after(min(self._lost.values())))
            self._lost, self._repeated_at = {}, utime
        if self._said is not None and self._is_awaited and at_rest and not self._lacks_any():
            self._advance()
            out.append(self._after(self._before))
        if self.is_waiting and utime >= self._asks_at:
            is_long = utime - self._waits_since > PATIENCE_US
            self._asks_at = utime + (ASK_LATER_US if is_long else ASK_US)
            out.append(self._question())
        elif self._is_unheard() and utime - self._told_at >= ASK_LATER_US:
            self._told_at, self._questions = utime, self._questions + 1
            out.append(self._question())
        return out

    def _question(self) -> PublicPoses:
        """Which moves of our neighbours we hold."""
        moves = {chain: peer.round for chain, peer in self._heard.items()}
        return PublicPoses(
            frame=self._own.robot,
            frame_epoch=self._own.epoch,
            rank=1,
            keyframes=(),
            values=np.zeros((1, 2), dtype=complex),
            round=self.round,
            since=self.round,
            asks=True,
            held=tuple((chain.robot, moves.get(chain, 0)) for chain in self._neighbours),
        )


def public_poses(frame: Chain, lifted: Lifted, said: Iterable[int] = ()) -> PublicPoses:
    """All of our poses that carry closures, and those that we said when they did: others hold
    them, and a closure that is kept again is used at once, with the pose that they hold."""
    chosen = np.isin(lifted.n, lifted.carriers) | np.isin(lifted.n, list(said))
    values = np.concatenate([lifted.anchor[None], lifted.rows[chosen]])
    keyframes = tuple(int(n) for n in lifted.n[chosen])
    return PublicPoses(frame.robot, frame.epoch, len(lifted.anchor) // 2, keyframes, values)


def _news(now: PublicPoses, before: dict[int, Array], weights: Mapping[int, Array]) -> list[int]:
    """Keyframes that moved since they were said by more than matters, or were not said."""
    out = []
    for n, row in zip(now.keyframes, now.values[1:], strict=True):
        if n in before:
            turn, place = weights[n]
            change = np.abs(row - before[n]) ** 2
            if turn * change[: now.rank].sum() + place * change[now.rank :].sum() <= MATTERS:
                continue
        out.append(n)
    return out
