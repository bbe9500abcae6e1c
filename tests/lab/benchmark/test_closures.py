"""The benchmark's closures: good ones agree, wrong ones do not."""

from __future__ import annotations

from lab.benchmark import closures

from drslamd.slam.consistency.pcm import PairConsistency


def test_good_closures_agree_and_wrong_ones_do_not() -> None:
    pair = PairConsistency(closures.NOISE, closures.NOISE, 0.05)
    for candidate in closures.candidates(100, 0.5, 3):
        pair.add(candidate)
    assert 30 <= len(pair.kept()) <= 60
    lonely = PairConsistency(closures.NOISE, closures.NOISE, 0.05)
    for candidate in closures.candidates(100, 0.0, 3):
        lonely.add(candidate)
    assert len(lonely.kept()) < 6
