"""What is gathered from robots after a run, against what they were played."""

from __future__ import annotations

import numpy as np
import pytest
import team_answers
from lab.report import evidence
from lab.report.evidence import Evidence, gather
from lab.score import metrics


@pytest.fixture(scope="module")
def found() -> Evidence:
    return gather(team_answers.team().simulator)


def test_every_pair_has_its_residuals_at_times_of_the_recording(found: Evidence) -> None:
    assert list(found.residuals) == ["0-1", "0-2", "1-2"]
    for pair in found.residuals.values():
        assert len(pair.t) == len(pair.metres) == len(pair.sigma) > 20
        assert -0.1 <= pair.t.min() < pair.t.max() < 41
        assert np.sqrt(np.mean(pair.metres**2)) < 0.1
        assert np.median(pair.sigma) == pytest.approx(0.1, abs=0.03)


def test_what_is_kept_agrees_with_each_other_and_with_the_truth(found: Evidence) -> None:
    """A pair that began anew of late has no matrix yet."""
    assert {"0-1", "0-2"} <= set(found.agreement) <= {"0-1", "0-2", "1-2"}
    for name, pair in found.agreement.items():
        count = len(pair.t)
        assert pair.squared.shape == (count, count)
        assert (pair.squared == pair.squared.T).all()
        kept = np.flatnonzero(pair.kept)
        assert len(kept) >= 3, name
        # chi-squared with three degrees of freedom, as `consistency.epsilon` says by default
        assert pair.squared[np.ix_(kept, kept)].max() < 20
        assert (np.diff(pair.t) >= 0).all()


def test_only_the_newest_closures_are_in_a_matrix(
    found: Evidence, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(evidence, "MOST_CLOSURES", 5)
    few = gather(team_answers.team().simulator)
    for name, pair in few.agreement.items():
        whole = found.agreement[name]
        assert np.array_equal(pair.squared, whole.squared[-5:, -5:])
        assert np.array_equal(pair.kept, whole.kept[-5:])
        assert np.array_equal(pair.t, whole.t[-5:])


def test_published_poses_are_near_the_truth_of_their_time(found: Evidence) -> None:
    """Each in the frame that it names, before and after all met."""
    trails = team_answers.recording().trails
    for robot, said in found.published.items():
        truth = metrics.at_times(trails[robot].t, trails[robot].truth, said.t)
        origins = np.array([trails[frame].truth[0] for frame in said.frame.tolist()])
        off = said.poses - metrics.relative(origins, truth)
        assert len(off) > 5
        assert np.median(np.hypot(off[:, 0], off[:, 1])) < 0.5
        assert set(said.state.tolist()) <= {1, 2}
        assert (np.linalg.eigvalsh(said.covariances)[:, 0] > 0).all()


def test_bytes_are_those_that_were_sent(found: Evidence) -> None:
    for robot, by_kind in found.sent.items():
        sent = team_answers.team().member(robot).traces.sent
        assert sum(by_kind.values()) == sum(len(payload) for _, _, payload in sent)
        assert {"GRAPH", "POSE", "STATUS"} <= set(by_kind)
        assert set(by_kind) <= {"GRAPH", "ODOMETRY", "POSE", "STATUS"}
