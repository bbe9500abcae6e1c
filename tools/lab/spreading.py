"""How soon what is said is everywhere at a loss of 70 %, and how large logs grow in ten hours.

The conversations are those of `lab.healing`. Each prints one line, with what it shall show.

    python -m lab.spreading              # both, five minutes
    python -m lab.spreading loss         # entries at a loss of 70 %
    python -m lab.spreading logs         # logs of twenty robots
"""

from __future__ import annotations

import argparse
import sys

from drslamd.conventions import Chain
from lab.healing import PARTNERS, SECOND, Conversation
from lab.progress import Progress

WARM_S = 30
"""Until everybody knows how much is lost."""


def rounds_until_everywhere(talk: Conversation, seconds: int) -> list[int]:
    """Seconds until all hold an entry, of all entries of so long a time. In a round, a second, each
    robot that lacks something sends a status. What is under way at the end counts as long as it
    was."""
    talk.seconds(WARM_S)
    talk.said.clear()
    rounds: list[int] = []
    for _ in range(seconds):
        talk.seconds(1)
        under_way = []
        logs = [mate.team.logs for mate in talk.mates.values()]
        for origin, seq, utime in talk.said:
            if all(log.is_known(origin, seq) for log in logs):
                rounds.append((talk.utime - utime) // SECOND)
            else:
                under_way.append((origin, seq, utime))
        talk.said = under_way
    return rounds + [(talk.utime - utime) // SECOND for _, _, utime in talk.said]


def bytes_of_log(seconds: int, partners: int) -> int:
    """Of one robot that ranges to so many others all the time, as everybody keeps it."""
    talk = Conversation(partners + 1)
    talk.hears = lambda a, b: False
    mate = talk.mates[0]
    progress = Progress("log", seconds)
    for second in range(seconds):
        talk.utime += SECOND
        talk.drive(0, mate, [Chain(robot, 1) for robot in range(1, partners + 1)])
        progress(second)
    progress.end()
    return mate.team.logs.bytes_held


def _loss() -> None:
    rounds = sorted(rounds_until_everywhere(Conversation(5, 0.7, 1), 600))
    half, most = (rounds[round(share * (len(rounds) - 1))] for share in (0.5, 0.99))
    print(
        f"loss 70%, five robots, {len(rounds)} entries: everywhere after {half} rounds (half of "
        f"them), {most} (99 %, shall be 10), {rounds[-1]} (all)"
    )


def _logs() -> None:
    size = 20 * bytes_of_log(36_000, PARTNERS) / 1e6
    print(
        f"logs of 20 robots that range to {PARTNERS} others for ten hours: {size:.1f} MB "
        "(shall be 20)"
    )


def main() -> int:
    """Print what is asked for."""
    parser = argparse.ArgumentParser(description="How soon entries spread, how large logs grow.")
    parser.add_argument("what", nargs="?", choices=["loss", "logs"], help="only this")
    chosen = parser.parse_args().what
    for name, show in (("loss", _loss), ("logs", _logs)):
        if chosen in (None, name):
            show()
    return 0


if __name__ == "__main__":
    sys.exit(main())
