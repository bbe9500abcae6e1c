"""Why robots are not localised, and what was refused on the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

MOST = 6
"""Reasons of a robot that are named, the most frequent first."""


def lines(
    status: Mapping[int, Mapping[str, Any]],
    lasted: Mapping[int, Sequence[tuple[int, str]]] | None = None,
) -> list[str]:
    """Of robots that are not localised: what each says of itself.

    Args:
        status: of each robot at the end, as `report.status` gives it.
        lasted: of each robot, seconds and what it complained of so long; what it says at the end
            where nobody counted.
    """
    lost = [robot for robot, said in sorted(status.items()) if "frame" not in said["pose"]]
    out: list[str] = []
    for robot in lost:
        said = status[robot]
        out.append(f"robot {robot} is {said['pose']['state']}")
        if lasted is None:
            out += [f"  {problem}" for problem in said["problems"]]
        else:
            out += [f"  for {s} s: {what}" for s, what in lasted.get(robot, ())[:MOST]]
        out += _pairs(said) + _refused(said)
    return out


def _pairs(said: Mapping[str, Any]) -> list[str]:
    """What became of the windows and closures with each peer."""
    out = []
    for peer, pair in said["pairs"].items():
        windows = sorted(pair["windows"].items(), key=lambda item: -item[1])
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in windows[:MOST])
        state = "connected" if pair["connected"] else "not connected"
        out.append(
            f"  with robot {peer}: {state}; windows: {verdicts or 'none'}; "
            f"closures: {pair['closures_kept']} kept of {pair['closures_seen']}"
        )
    return out


def _refused(said: Mapping[str, Any]) -> list[str]:
    """What came in and was not believed."""
    counters = {**said["uwb"]["counters"], **said["wheels"]["counters"]}
    refused = {
        name.replace(".refused.", " refused: "): count
        for name, count in counters.items()
        if ".refused." in name and count
    }
    refused |= {f"messages refused: {r}": n for r, n in said["network"]["refused"].items() if n}
    most = sorted(refused.items(), key=lambda item: -item[1])[:MOST]
    return [f"  {count} {name}" for name, count in most]
