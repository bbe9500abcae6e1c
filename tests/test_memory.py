"""What outlives a start of a robot, and when it is worth a write."""

from __future__ import annotations

import pytest
from message_builders import SECRET

from drslamd.conventions import SECOND_US, Chain, Segment
from drslamd.events import SaveDone
from drslamd.gossip.epochs import LAST_KEPT_EPOCH
from drslamd.gossip.seal import Seal, team_key
from drslamd.memory import MOVED, Memory
from drslamd.slam.calibration.calibration_store import CalibrationStore
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.graph.estimate import Learned, TeamEstimate
from drslamd.slam.relocation.last_place import LastPlace, SeenFrom

KEPT = SensorCalibration(Learned(0.1, 0.01), Learned(0.001, 0.0005), {4: Learned(-0.2, 0.05)})

PLACE = LastPlace(0.5, (SeenFrom(Chain(4, 11), 120, 12_300_000, 1.5, -2.0, 0.2),))


class Remembering:
    """Robot 2 in its start 7; it knew starts of robots 4 and 9 before."""

    def __init__(self, kept: SensorCalibration = UNLEARNED, place: LastPlace | None = None) -> None:
        self.seal = Seal(team_key(SECRET), 2, 7, {4: 11, 9: 12})
        self.calibration = CalibrationStore(kept, True)
        self.memory = Memory(Chain(2, 7), self.seal, self.calibration, place)

    def learn(self, scale: float) -> None:
        estimate = TeamEstimate(Segment(2, 7, 0), {}, scale={2: Learned(scale, 0.005)})
        self.calibration.update(estimate, 2, [])


def test_the_own_epoch_those_of_the_others_and_the_calibration_are_kept() -> None:
    state = Remembering(KEPT).memory.state()
    epochs = {4: 11, 9: 12}
    assert state == {"epoch": 7, "epochs": epochs, "calibration": KEPT.state(), "place": {}}


@pytest.mark.parametrize("above", [0, 1])
def test_an_epoch_that_no_state_file_may_hold_is_left_out(above: int) -> None:
    scene = Remembering()
    scene.seal.epochs[9] = LAST_KEPT_EPOCH + above
    known = scene.memory.state()["epochs"]
    assert known == ({4: 11} if above else {4: 11, 9: LAST_KEPT_EPOCH})


def test_nothing_is_written_while_there_is_nothing_new() -> None:
    scene = Remembering(KEPT)
    assert scene.memory.save() == []
    assert scene.memory.fault == ""


def test_a_new_epoch_of_anybody_is_written_once() -> None:
    scene = Remembering()
    for epochs in ({4: 13}, {5: 1}):
        scene.seal.epochs.update(epochs)
        (save,) = scene.memory.save()
        assert save.state == scene.memory.state()
        assert save.state["epochs"] == scene.seal.epochs
        assert scene.memory.save() == []


def test_what_was_learned_is_written_once_and_again_when_it_has_moved() -> None:
    scene = Remembering()
    for scale in (0.04, -0.04):
        scene.learn(scale)
        (save,) = scene.memory.save()
        assert save.state["calibration"] == scene.calibration.latest.state()
        assert scene.calibration.latest.scale.value == pytest.approx(scale)
        assert scene.memory.save() == []


def test_a_place_is_kept_until_another_one_is_known() -> None:
    memory = Remembering(place=PLACE).memory
    assert memory.state()["place"] == PLACE.state()
    memory.remember(None, 1_000)
    assert memory.place is PLACE
    later = LastPlace(0.7, PLACE.seen)
    memory.remember(later, 1_000)
    assert memory.state()["place"] == later.state()


def test_where_a_robot_is_that_drove_on_is_written_and_where_one_stands_is_not() -> None:
    memory = Remembering().memory
    memory.remember(PLACE, MOVED - 1)
    assert memory.save() == []
    memory.remember(PLACE, MOVED)
    (save,) = memory.save()
    assert save.state["place"] == PLACE.state()
    memory.remember(PLACE, 2 * MOVED - 1)
    assert memory.save() == []


@pytest.mark.row("S7")
def test_a_start_whose_number_could_not_be_kept_listens_for_ten_seconds() -> None:
    scene = Remembering()
    memory, t0 = scene.memory, 100 * SECOND_US
    assert not memory.is_listening(t0)
    memory.on_saved(SaveDone(t0, ""))
    assert not memory.is_listening(t0)
    memory.on_saved(SaveDone(t0, "cannot write it: Read-only file system"))
    assert memory.is_listening(t0 + 10 * SECOND_US - 1)
    assert not memory.is_listening(t0 + 10 * SECOND_US)


def test_a_disk_that_fails_later_silences_nobody() -> None:
    scene = Remembering()
    scene.seal.header(0)
    scene.memory.on_saved(SaveDone(SECOND_US, "cannot write it: No space left on device"))
    assert not scene.memory.is_listening(SECOND_US)
