"""The answer to ``status`` as a table that is drawn anew each second.

What is wrong stands above everything else. Rates are the differences of two answers.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

PEER_COLUMNS = (
    "robot", "heard", "loss", "hears us", "clock ms", "+- ms", "ranged", "closures", "pair", "pose",
)  # fmt: skip
FEWEST_ROWS = 4
"""Of a terminal that is too low for everything."""
NARROWEST = 20
"""Columns in which a sentence can be read."""
NOTHING = "-"


def table(
    now: dict[str, Any], before: dict[str, Any] | None = None, seconds: float = 1.0
) -> list[str]:
    """Lines of one picture.

    Args:
        before: the answer so many `seconds` earlier, for rates.
    """
    out = [f"robot {now['robot']}: {_pose(now['pose'])}"]
    if now["insecure"]:
        out.append("! INSECURE: no team key, anybody on the network can forge messages")
    out += [f"! {c['what']} (since {span(c['since_s'])})" for c in now["conditions"]]
    out += [f"? {left['what']}" for left in now.get("hypotheses", ())]
    out += ["", *_inputs(now, before, seconds), ""]
    rows = [_peer(robot, peer, now) for robot, peer in now["peers"].items()]
    out += columns([PEER_COLUMNS, *rows]) if rows else ["no other robot is heard"]
    group = ", ".join(map(str, now["graph"]["group"])) or "none"
    return [*out, "", f"connected group: {group}"]


def fitted(lines: Sequence[str], width: int, height: int) -> list[str]:
    """As much of it as a terminal shows; the last line says what is left out.

    Sentences, which stand before the first empty line, are folded: what to do is their end. Rows of
    tables are cut off.
    """
    rows = max(height, FEWEST_ROWS)
    sentences = lines.index("") if "" in lines else len(lines)
    shown = [piece for line in lines[:sentences] for piece in _folded(line, width)]
    shown += [line[:width] for line in lines[sentences:]]
    if len(shown) <= rows:
        return shown
    return [*shown[: rows - 1], f"... {len(shown) - rows + 1} more lines"[:width]]


def _folded(sentence: str, width: int) -> list[str]:
    if width < NARROWEST:
        return [sentence[:width]]
    return textwrap.wrap(sentence, width, subsequent_indent="  ")


def span(seconds: float) -> str:
    """A time that has passed, in the unit that one would say."""
    for unit, length in (("d", 86_400), ("h", 3_600), ("min", 60)):
        if seconds >= 2 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{seconds:.0f} s"


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows under each other; every cell on the right of its column."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in rows]


def _pose(pose: dict[str, Any]) -> str:
    if "frame" not in pose:
        return str(pose["state"])
    return (
        f"{pose['state']} in the frame of robot {pose['frame']}, x {pose['x_m']:.2f} m, "
        f"y {pose['y_m']:.2f} m, {_heading(pose)}, sigma {pose['sigma_m']:.2f} m"
    )


def _heading(pose: dict[str, Any]) -> str:
    return "heading not known" if pose["theta_deg"] is None else f"{pose['theta_deg']:.1f} deg"


def _inputs(now: dict[str, Any], before: dict[str, Any] | None, seconds: float) -> list[str]:
    """Both sensors and the network, with what comes in a second."""

    def rate(*path: str) -> str:
        if before is None or seconds <= 0:
            return NOTHING
        return f"{(_at(now, path) - _at(before, path)) / seconds:.0f}/s"

    uwb, wheels, network = now["uwb"], now["wheels"], now["network"]
    return columns(
        [
            ("", "state", "good", "arrived", "good ones", "sent"),
            (
                "uwb",
                uwb["port"],
                _age(uwb["age_s"]),
                rate("uwb", "counters", "bytes") + " bytes",
                rate("uwb", "counters", "frames.accepted") + " frames",
                NOTHING,
            ),
            (
                "wheels",
                wheels["port"],
                _age(wheels["age_s"]),
                rate("wheels", "counters", "messages.accepted") + " messages",
                rate("wheels", "counters", "samples.accepted") + " samples",
                NOTHING,
            ),
            (
                "network",
                "up" if network["up"] else "DOWN",
                _age(network["own_echo_age_s"]),
                NOTHING,
                rate("network", "accepted") + " messages",
                rate("network", "bytes_sent") + " bytes",
            ),
        ]
    )


def _at(answer: dict[str, Any], path: Sequence[str]) -> float:
    value: Any = answer
    for key in path:
        value = value.get(key, {}) if isinstance(value, dict) else {}
    return float(value) if isinstance(value, (int, float)) else 0.0


def _peer(robot: str, peer: dict[str, Any], now: dict[str, Any]) -> tuple[str, ...]:
    ranges = [r for r in now["uwb"]["ranges"].values() if str(r["robot"]) == robot]
    pair = now["pairs"].get(robot)
    clock, sure = peer["clock_offset_ms"], peer["clock_uncertainty_ms"]
    return (
        robot,
        span(peer["age_s"]) if peer["alive"] else f"SILENT {span(peer['age_s'])}",
        f"{100 * peer['loss']:.0f} %",
        "yes" if peer["hears_us"] else "NO",
        NOTHING if clock is None else f"{clock:+.1f}",
        NOTHING if sure is None else f"{sure:.1f}",
        _age(min((r["age_s"] for r in ranges), default=None)),
        f"{pair['closures_kept']} of {pair['closures_seen']}" if pair else NOTHING,
        NOTHING if pair is None else ("connected" if pair["connected"] else "not yet"),
        str(peer["pose"] or NOTHING),
    )


def _age(seconds: float | None) -> str:
    return "never" if seconds is None else f"{span(seconds)} ago"
