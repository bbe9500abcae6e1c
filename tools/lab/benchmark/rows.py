"""What a benchmark says: one row per promise, with its peers, as Markdown and as JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

WORSE = 1.5
"""Ratios to a peer move by so much with the machine and its load."""
MORE = ("share", "closures")
WORSE_COUNT = 1.1
"""Rounds, bytes and shares do not."""


@dataclass(frozen=True)
class Peer:
    """Somebody else at the same work.

    Attributes:
        value: in the unit of the row.
        here: measured in this run; otherwise on another machine, quoted.
    """

    name: str
    value: float
    here: bool


@dataclass(frozen=True)
class Row:
    """One figure of ours.

    Attributes:
        module: of drslamd, 1 to 3, or 0 for all of them together.
        value: a median where it is a time.
        unit: "ms", "s", "rounds", "MB", "ratio", "gap", or "share" and "closures", of which more
            is better.
        goal: to reach, None where the row only informs or `times` is the goal.
        times: so many times as fast as the first peer of this run it is to be, on any machine.
        curve: the curve of `--picture` that the row is a point of, and its place on the axis.
    """

    module: int
    work: str
    value: float
    unit: str
    goal: float | None = None
    p99: float | None = None
    peers: tuple[Peer, ...] = ()
    curve: tuple[str, float] | None = None
    times: float | None = None

    @property
    def name(self) -> str:
        """What finds the row in another run."""
        return f"{self.module} {self.work} [{self.unit}]"

    @property
    def is_met(self) -> bool | None:
        if self.times is not None:
            return next(iter(self.ratios().values()), 0.0) >= self.times
        if self.goal is None:
            return None
        return self.value >= self.goal if self.unit in MORE else self.value <= self.goal

    def ratios(self) -> dict[str, float]:
        """How many times more each peer of this run needs."""
        return {p.name: p.value / self.value for p in self.peers if p.here and self.value}


def markdown(rows: list[Row]) -> str:
    """A table for people."""
    lines = [
        "| module | work | drslamd | p99 | goal | peer in this run | elsewhere (quoted) |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        here = "; ".join(_beside(row.value, p) for p in row.peers if p.here)
        there = "; ".join(f"{p.name} {_number(p.value)}" for p in row.peers if not p.here)
        wanted = _number(row.goal) if row.goal is not None else ""
        if row.times is not None:
            wanted = f"{_number(row.times)} x"
        goal = f"{wanted} {'✓' if row.is_met else 'MISSED'}" if wanted else ""
        p99 = "" if row.p99 is None else _number(row.p99)
        value = f"{_number(row.value)} {row.unit}"
        lines.append(
            f"| {row.module or 'all'} | {row.work} | {value} | {p99} | {goal} | {here} | {there} |"
        )
    return "\n".join(lines)


def _beside(value: float, peer: Peer) -> str:
    times = f" {_number(peer.value)} ({peer.value / value:.1f} x)" if value else ""
    return peer.name + times


def _number(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def to_json(rows: list[Row]) -> list[dict[str, Any]]:
    return [asdict(row) for row in rows]


def from_json(data: list[dict[str, Any]]) -> list[Row]:
    """
    Raises:
        KeyError, TypeError: it is not what `to_json` writes.
    """
    return [
        Row(
            **{
                **item,
                "peers": tuple(Peer(**peer) for peer in item["peers"]),
                "curve": tuple(item["curve"]) if item.get("curve") else None,
            }
        )
        for item in data
    ]


def regressions(now: list[Row], stored: list[Row]) -> list[str]:
    """What became worse, in sentences; rows that only one run has are not compared."""
    before = {row.name: row for row in stored}
    out = []
    for row in now:
        old = before.get(row.name)
        if old is None:
            continue
        if row.unit in ("ms", "s"):
            then = old.ratios()
            for peer, ratio in row.ratios().items():
                if peer in then and ratio * WORSE < then[peer]:
                    out.append(
                        f"{row.name}: {ratio:.2f} times as fast as {peer}, was {then[peer]:.2f}"
                    )
        elif row.unit == "gap":
            continue
        elif row.unit in MORE:
            if row.value * WORSE_COUNT < old.value:
                out.append(f"{row.name}: {row.value:.3f}, was {old.value:.3f}")
        elif row.value > old.value * (WORSE if row.unit == "ratio" else WORSE_COUNT):
            out.append(f"{row.name}: {row.value:.3g}, was {old.value:.3g}")
    return out
