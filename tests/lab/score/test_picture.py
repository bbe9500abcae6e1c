"""The demo's picture: drawn whole, also of a team that found nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.recordings import world
from lab.score import panels, picture
from lab.score.outcome import Outcome
from lab.score.outcome import Path as Track
from matplotlib import image

RECORDING = world.simulate(world.Scene(robots=2, seconds=5.0, odometry_hz=10, range_hz=10), 2)


def exact() -> Outcome:
    trails = RECORDING.trails
    return Outcome(
        final={r: Track(t.t, t.truth, np.zeros(len(t.t))) for r, t in trails.items()},
        bytes_sent=dict.fromkeys(trails, 0),
    )


@pytest.mark.parametrize("outcome", [exact(), Outcome()], ids=["found", "not localised"])
def test_a_picture_is_drawn_of_whatever_was_found(outcome: Outcome, tmp_path: Path) -> None:
    path = tmp_path / "new" / "demo.png"
    picture.draw(RECORDING, outcome, path)
    pixels = image.imread(path)
    assert pixels.shape[:2] == (946, 1430)
    # the colours of both robots and of the truth are there
    drawn = {tuple(p) for p in np.rint(255 * pixels[..., :3]).astype(int).reshape(-1, 3)[::3]}
    for colour in (*panels.COLOURS[:2], panels.TRUTH):
        assert tuple(bytes.fromhex(colour[1:])) in drawn
    assert list(path.parent.iterdir()) == [path]


def test_a_failed_drawing_leaves_the_picture_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "demo.png"
    path.write_text("good")
    monkeypatch.setattr(picture, "_errors", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        picture.draw(RECORDING, exact(), path)
    assert path.read_text() == "good"
