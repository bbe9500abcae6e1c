"""Doing without one piece, and having it back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from lab.accuracy.ablation import PIECES, Piece, without
from lab.play import edge_run, virtual_team
from lab.play.playback import equip
from lab.recordings import injection, world
from lab.recordings.recording import EdgeRecording
from lab.score import metrics
from lab.score.outcome import Outcome
from teams import EASY

from drslamd.config import parse
from drslamd.slam.optimizer.banded.normal_equations import System
from drslamd.slam.relative_pose import pair_window
from drslamd.slam.relative_pose.window_noise import near_bias

ROBOT = """
[robot]
id = 1
[team]
insecure = true
[uwb]
port = "x"
[wheels]
source = "kobuki"
port = "y"
"""

NOTHING = Piece("")
SCENE = replace(EASY, robots=2, seconds=25.0)
EDGE_SIGMAS = (0.1, 0.03)


def behind_a_wall(t: float) -> bool:
    """3 s out of 10 s; then ranges are a metre too long and their first path is weak."""
    return t % 10.0 > 7.0


def played(piece: Piece) -> Outcome:
    """What a team of two makes of a scene without the piece."""
    recording = world.simulate(SCENE, 3)
    recording.ranges[[behind_a_wall(t) for t in recording.ranges[:, 0]], 3] += 1.0
    hardware = equip(recording)
    for device in hardware.values():
        device.uwb.gap_db = lambda t, peer: 14.0 if behind_a_wall(t) else 3.0
    with without(piece):
        return virtual_team.run(recording, extra=piece.toml, hardware=hardware)


def misled_pair() -> EdgeRecording:
    """Three robots that see each other's poses every second; those of robots 1 and 2 are wrong."""
    trails = world.simulate(replace(EASY, seconds=40.0), 3).trails
    t = np.arange(1.0, 39.0)
    at = {robot: metrics.at_times(trail.t, trail.truth, t) for robot, trail in trails.items()}
    noise = np.random.default_rng(0).normal(size=(3, len(t), 3)) * EDGE_SIGMAS[1]
    rows = [
        np.column_stack([t, np.tile([a, b], (len(t), 1)), metrics.relative(at[a], at[b]) + off])
        for (a, b), off in zip(((0, 1), (0, 2), (1, 2)), noise, strict=True)
    ]
    clean = EdgeRecording("made", trails, np.concatenate(rows), EDGE_SIGMAS)
    return injection.misled(clean, np.array([1, 2]), 12, 3)


def played_on_edges(piece: Piece) -> Outcome:
    with without(piece):
        return edge_run.run(misled_pair(), piece.toml, optimizer="closures")[0]


def answers(outcome: Outcome) -> list[object]:
    """All that robots said, to the last bit."""
    closures = [(c.t, c.kept, c.poses.tolist(), c.covariances.tolist()) for c in outcome.closures]
    return [closures, {robot: path.poses.tolist() for robot, path in outcome.final.items()}]


def play_of(name: str) -> Callable[[Piece], Outcome]:
    """The scene in which a piece shows: pairs that disagree are what `gnc` is for."""
    return played_on_edges if name == "gnc" else played


@cache
def with_all_pieces(play: Callable[[Piece], Outcome]) -> Outcome:
    outcome = play(NOTHING)
    assert outcome.is_one_team
    return outcome


@pytest.mark.parametrize("name", list(PIECES))
def test_a_team_without_a_piece_answers_something_else(name: str) -> None:
    play = play_of(name)
    less, whole = play(PIECES[name]), with_all_pieces(play)
    assert len(less.closures) == len(whole.closures) > 10
    assert answers(less) != answers(whole)


@pytest.mark.parametrize("play", [played, played_on_edges])
def test_a_team_with_all_pieces_answers_the_same_after_they_were_left_out(
    play: Callable[[Piece], Outcome],
) -> None:
    before = with_all_pieces(play)
    for piece in PIECES.values():
        with without(piece):
            pass
    assert answers(play(NOTHING)) == answers(before)


@pytest.mark.parametrize("name", list(PIECES))
def test_each_piece_changes_something_and_is_back_afterwards(name: str) -> None:
    piece = PIECES[name]
    assert piece.toml or piece.exchanged
    assert (parse(ROBOT + piece.toml) != parse(ROBOT)) == bool(piece.toml)
    before = [getattr(owner, key) for owner, key, _ in piece.exchanged]
    with without(piece):
        now = [getattr(owner, key) for owner, key, _ in piece.exchanged]
        assert all(a is not b for a, b in zip(before, now, strict=True))
    assert [getattr(owner, key) for owner, key, _ in piece.exchanged] == before


def test_what_is_exchanged_is_what_is_read() -> None:
    with without(PIECES["short-range-doubt"]):
        assert near_bias(0.5) == 0.0
    assert near_bias(0.5) > 0.1
    with without(PIECES["closure-dating"]):
        assert pair_window.CONFIRM_US == 0


def test_gauss_holds_the_far_away_as_tightly_as_the_near() -> None:
    def pull(error: float) -> float:
        system = System(np.zeros((1, 0)), np.zeros((0, 1)), np.zeros((1, 1)), np.zeros(1), 0.0)
        system.add_cauchy_prior(np.array([0]), np.array([error]), np.array([0.1]))
        return float(system.gradient[0] / error)

    assert pull(1.0) < 0.02 * pull(0.01)
    with without(PIECES["cauchy-priors"]):
        assert pull(1.0) == pytest.approx(pull(0.01)) == pytest.approx(100.0)


def test_a_failure_puts_everything_back() -> None:
    before = pair_window.CONFIRM_US
    with pytest.raises(RuntimeError), without(PIECES["closure-dating"]):
        raise RuntimeError
    assert before == pair_window.CONFIRM_US
