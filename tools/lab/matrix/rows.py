"""The 64 rows: what goes wrong and what then has to hold, in a few words each.

D drivers, M measurements, N network, S security, T time, O operations.
"""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """One row.

    Attributes:
        line: what has to hold.
        simulated: what a plain Linux machine lacks for it, so that it is played in virtual time.
    """

    fault: str
    line: str
    simulated: str = ""


ROWS: dict[str, Row] = {
    "D1": Row(
        "garbage bytes between frames",
        "99.9 % of whole frames arrive; of random bytes alone nothing counts",
    ),
    "D2": Row(
        "bit errors inside frames",
        "fewer than 1 of 100,000 damaged frames is used",
    ),
    "D3": Row(
        "one poisoned byte",
        "the next whole frame arrives, for all 256 values",
    ),
    "D4": Row(
        "bytes cut anywhere",
        "the same events, however they are cut",
    ),
    "D5": Row(
        "a cable pulled in mid-frame and put back",
        "named in 1 s, read again in 3 s, no descriptor leaks",
    ),
    "D6": Row(
        "a device that gets another number",
        "found again by its lasting name",
    ),
    "D7": Row(
        "the wrong baud rate",
        "named with rate and port within 5 s, no sample",
    ),
    "D8": Row(
        "a port that is busy, forbidden or missing",
        "one sentence, read again 5 s after it is put right",
    ),
    "D9": Row(
        "a CAN bus that is silent, off or flooded",
        "stale in half a second, the loop lags less than 20 ms",
    ),
    "D10": Row(
        "counters and times that overflow",
        "increments go on over every wrap",
    ),
    "D11": Row(
        "a sensor's clock or counter begins anew or drifts",
        "what spans it is left out, the rest is kept",
        "a sensor that reboots and drifts",
    ),
    "M1": Row(
        "encoders that are stuck",
        "flagged, no edge of that time, clears after repair",
        "wheels and floors",
    ),
    "M2": Row(
        "wheels that slip",
        "flagged, no wrong edge, team ATE at most 1.2 x",
        "wheels and floors",
    ),
    "M3": Row(
        "blocked sight and frozen ranges",
        "errors within what is claimed, ATE at most 1.5 x",
        "walls",
    ),
    "M4": Row(
        "range outliers",
        "no wrong edge up to 30 %",
        "radio",
    ),
    "M5": Row(
        "motion that shows nothing",
        "no pose is made up, and why is said",
        "robots that drive",
    ),
    "M6": Row(
        "mirror images",
        "never the wrong one as the only one",
        "robots that drive",
    ),
    "M7": Row(
        "missing ranges",
        "later, not wrong",
        "radio",
    ),
    "M8": Row(
        "a bias that nobody configured",
        "named after five minutes at most",
        "antennas",
    ),
    "M9": Row(
        "numbers that are none",
        "counted by reason, nothing else",
    ),
    "M10": Row(
        "every gate just inside and just outside",
        "one is taken, one refused",
    ),
    "N1": Row(
        "independent loss",
        "at 70 % all hold an entry within 10 rounds (p99)",
        "several computers on one radio",
    ),
    "N2": Row(
        "loss in bursts",
        "whole 5 s after each burst",
        "several computers on one radio",
    ),
    "N3": Row(
        "duplicates",
        "the same graph",
    ),
    "N4": Row(
        "late and reordered messages",
        "the same graph, to the bit",
        "several computers on one radio",
    ),
    "N5": Row(
        "one-way links and pairs that do not hear each other",
        "agreed through others",
        "several computers on one radio",
    ),
    "N6": Row(
        "partition and rejoin",
        "equal within 30 s, within 60 s at 30 % loss; at most 2 x the steady traffic",
        "several computers on one radio",
    ),
    "N7": Row(
        "malformed datagrams",
        "ten million change counters only",
    ),
    "N8": Row(
        "floods",
        "sensors are read on time, honest peers heard",
    ),
    "N9": Row(
        "oversize messages",
        "never sent, never believed",
    ),
    "N10": Row(
        "interfaces that go, come and change",
        "named, joined again in 5 s",
    ),
    "N11": Row(
        "our own echo",
        "no peer and no clash",
    ),
    "N12": Row(
        "other versions and unknown kinds",
        "skipped and named",
    ),
    "S1": Row(
        "a stranger without the key",
        "only counters change",
    ),
    "S2": Row(
        "another team key on one robot",
        "does not merge, said on both sides in 5 s",
        "several computers",
    ),
    "S3": Row(
        "replay within a session",
        "nothing is heard twice, no number moves the window",
    ),
    "S4": Row(
        "replay to a robot that begins anew",
        "nothing of an absent robot counts",
        "hours",
    ),
    "S5": Row(
        "replay of an old epoch",
        "refused",
        "several computers",
    ),
    "S6": Row(
        "restarts",
        "epochs grow, together again in 10 s",
    ),
    "S7": Row(
        "a state folder that is lost or read-only",
        "a warning; no epoch is used twice",
    ),
    "S8": Row(
        "one id twice",
        "said in 5 s, neither is used",
        "several computers",
    ),
    "S9": Row(
        "a liar with the key",
        "the others' ATE at most 1.2 x",
        "a team that drives",
    ),
    "S10": Row(
        "a relay that edits",
        "refused",
    ),
    "S11": Row(
        "a key file that others may read, or is no key",
        "refused at start, with the remedy",
    ),
    "S12": Row(
        "secrets in what is written",
        "never",
    ),
    "T1": Row(
        "a wall clock that is set",
        "the same effects",
    ),
    "T2": Row(
        "suspend and resume",
        "named; no window spans it",
        "a computer that may be suspended",
    ),
    "T3": Row(
        "a loop that stalls",
        "late and right, no burst afterwards",
    ),
    "T4": Row(
        "clocks that disagree and drift",
        "results equal within 1 mm",
        "several clocks",
    ),
    "T5": Row(
        "dates that break programs",
        "nothing happens",
    ),
    "O1": Row(
        "configuration errors",
        "one sentence and exit code 78 in 1 s",
    ),
    "O2": Row(
        "a full disk",
        "recording stops, the robot does not; files are whole",
    ),
    "O3": Row(
        "recordings without end",
        "never above the cap",
        "10 GB",
    ),
    "O4": Row(
        "SIGTERM and SIGINT",
        "gone in 2 s, the others told",
    ),
    "O5": Row(
        "kill -9",
        "back in 5 s under a new epoch",
    ),
    "O6": Row(
        "a hang",
        "ended by the watchdog in 15 s",
    ),
    "O7": Row(
        "a day of memory",
        "RSS slope below 0.5 MB/h after hour 2",
        "a day",
    ),
    "O8": Row(
        "a day of descriptors, tasks, threads",
        "as many at the end as at the begin",
        "a day",
    ),
    "O9": Row(
        "too little processor",
        "later, no wheel tick is lost",
    ),
    "O10": Row(
        "budgets of processor and memory",
        "within 1.8 x of what is on record",
    ),
    "O11": Row(
        "log storms",
        "a line a minute for each reason",
    ),
    "O12": Row(
        "ill-conditioned graphs",
        "finite, and honest about it",
    ),
    "O13": Row(
        "old and new state files",
        "read, or said why not",
    ),
    "O14": Row(
        "least privilege",
        "systemd rates it 3.0 or better",
    ),
}
