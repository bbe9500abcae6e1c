"""How large logs grow: what each robot of a team holds of all, hour by hour, and after ten.

The team of `lab.healing` without a radio: everybody says what robots say that drive all the while
and range to ten others each second, and chapters stand for what is old.

    python -m lab.log_sizes             # twenty robots, three hours, ten worked out: ten minutes
    python -m lab.log_sizes --robots 5 --hours 10
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from drslamd.slam.graph.pose_graph import PoseGraph
from lab.healing import PARTNERS, SECOND, Conversation

HOUR_S = 3_600
ALL_HOURS = 10


def hourly_bytes(robots: int, hours: int, hour_s: int = HOUR_S) -> Iterator[tuple[int, int]]:
    """After each hour the bytes of all logs, as messages and as objects in memory."""
    talk = Conversation(robots)
    talk.hears = lambda a, b: False
    team = PoseGraph()
    for mate in talk.mates.values():
        # (nothing is lost, so all hold one graph)
        mate.graph = team
    for _ in range(hours):
        for _ in range(hour_s):
            talk.utime += SECOND
            for robot, mate in talk.mates.items():
                last = min(robot + PARTNERS, robots - 1)
                talk.drive(
                    robot, mate, [talk.mates[k].team.own for k in range(robot + 1, last + 1)]
                )
        logs = [mate.team.logs._logs[robot] for robot, mate in talk.mates.items()]
        objects = sum(
            sum(map(sys.getsizeof, log.sealed.values()))
            + sys.getsizeof(log.sealed)
            + sys.getsizeof(log.aired)
            for log in logs
        )
        yield sum(map(talk.log_bytes, talk.mates)), objects


def after(hours: int, measured: list[int]) -> float:
    """Bytes after so many hours, if those that were not measured add what the last one added."""
    grown = measured[-1] - measured[-2] if len(measured) > 1 else measured[-1]
    return measured[-1] + (hours - len(measured)) * grown


def main(arguments: list[str] | None = None) -> int:
    """Print a line for each hour."""
    parser = argparse.ArgumentParser(prog="lab.log_sizes", description="How large logs grow.")
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--hours", type=int, default=3)
    chosen = parser.parse_args(arguments)
    messages, objects = list[int](), list[int]()
    for of_messages, of_objects in hourly_bytes(chosen.robots, chosen.hours):
        messages.append(of_messages)
        objects.append(of_objects)
        print(
            f"{chosen.robots} robots, hour {len(messages)}: {of_messages / 1e6:.2f} MB of messages,"
            f" {of_objects / 1e6:.2f} MB in memory",
            flush=True,
        )
    said, held = (after(ALL_HOURS, sizes) / 1e6 for sizes in (messages, objects))
    print(f"after {ALL_HOURS} hours: {said:.2f} MB of messages, {held:.2f} MB in memory (20)")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
