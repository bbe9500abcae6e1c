"""When something begins to be wrong, now and then while it lasts, and when it is well again."""

from __future__ import annotations

from typing import Any

import pytest

from drslamd.conditions.health import MAX_CONDITIONS, REPEAT_US, Health
from drslamd.conventions import SECOND_US
from drslamd.events import Level, Note

T0 = 100 * SECOND_US


def fault(key: str, what: str, **fields: Any) -> Note:
    return Note(Level.WARNING, f"{key}.fault", {"what": what, **fields})


def test_what_begins_is_said_at_once_and_holds() -> None:
    health = Health()
    assert health.set("uwb", "no bytes", T0) == [fault("uwb", "no bytes")]
    assert health.sentences() == {"uwb": "no bytes"}


def test_what_is_well_and_was_well_is_no_news() -> None:
    health = Health()
    assert health.set("uwb", None, T0) == []
    assert health.sentences() == {}


@pytest.mark.parametrize(("after_us", "said"), [(REPEAT_US - 1, False), (REPEAT_US, True)])
@pytest.mark.row("O11")
def test_what_lasts_is_said_again_once_a_minute(after_us: int, said: bool) -> None:
    assert REPEAT_US == 60 * SECOND_US
    health = Health()
    health.set("uwb", "no bytes", T0)
    again = [fault("uwb", "no bytes", for_s=60)] if said else []
    assert health.set("uwb", "no bytes", T0 + after_us) == again


def test_a_minute_counts_from_what_was_said_last() -> None:
    health = Health()
    said = [health.set("uwb", "no bytes", T0 + k * SECOND_US) for k in range(181)]
    assert [k for k, notes in enumerate(said) if notes] == [0, 60, 120, 180]
    assert said[180] == [fault("uwb", "no bytes", for_s=180)]


def test_another_sentence_holds_at_once_and_waits_for_its_turn_in_the_log() -> None:
    health = Health()
    health.set("uwb", "no bytes for 3 s", T0)
    assert health.set("uwb", "no bytes for 4 s", T0 + SECOND_US) == []
    assert health.sentences() == {"uwb": "no bytes for 4 s"}
    assert health.set("uwb", "no bytes for 63 s", T0 + REPEAT_US) == [
        fault("uwb", "no bytes for 63 s", for_s=60)
    ]


def test_what_is_well_again_is_said_once_with_how_long_it_was_not() -> None:
    health = Health()
    health.set("uwb", "no bytes", T0)
    health.set("uwb", "no bytes", T0 + REPEAT_US)
    well = Note(Level.INFO, "uwb.well", {"after_s": 75})
    assert health.set("uwb", None, T0 + 75 * SECOND_US) == [well]
    assert health.set("uwb", None, T0 + 76 * SECOND_US) == []
    assert health.sentences() == {}


def test_what_comes_back_begins_anew() -> None:
    health = Health()
    health.set("uwb", "no bytes", T0)
    health.set("uwb", None, T0 + 50 * SECOND_US)
    back = T0 + 51 * SECOND_US
    assert health.set("uwb", "no bytes", back) == [fault("uwb", "no bytes")]
    assert health.set("uwb", "no bytes", back + REPEAT_US - 1) == []
    (note,) = health.set("uwb", "no bytes", back + REPEAT_US)
    assert note.fields["for_s"] == 60


def test_conditions_do_not_know_of_each_other_and_are_told_in_order() -> None:
    health = Health()
    health.set("wheels", "no motion", T0)
    assert health.set("uwb", "no bytes", T0 + SECOND_US) == [fault("uwb", "no bytes")]
    assert list(health.sentences().items()) == [("uwb", "no bytes"), ("wheels", "no motion")]
    health.set("wheels", None, T0 + 2 * SECOND_US)
    assert health.sentences() == {"uwb": "no bytes"}


def test_causes_stand_before_what_follows_from_them_and_each_says_since_when() -> None:
    health = Health()
    for second, key in enumerate(("pose", "another", "wheels", "team.own_id_used")):
        health.set(key, key, T0 + second * SECOND_US)
    assert list(health.sentences()) == ["team.own_id_used", "wheels", "pose", "another"]
    ages = health.ages_us(T0 + 10 * SECOND_US)
    assert list(ages) == list(health.sentences())
    assert ages["pose"] == 10 * SECOND_US
    assert ages["team.own_id_used"] == 7 * SECOND_US


@pytest.mark.row("O11")
def test_there_is_an_end_to_how_many_are_held() -> None:
    health = Health()
    for k in range(MAX_CONDITIONS):
        assert health.set(f"peer{k}", "silent", T0)
    assert health.set("one more", "silent", T0) == []
    assert len(health.sentences()) == MAX_CONDITIONS == 512
    assert "one more" not in health.sentences()


def test_a_full_table_still_tells_what_it_holds_and_has_room_again_afterwards() -> None:
    health = Health()
    for k in range(MAX_CONDITIONS):
        health.set(f"peer{k}", "silent", T0)
    assert health.set("peer7", "silent", T0 + REPEAT_US) == [fault("peer7", "silent", for_s=60)]
    assert health.set("peer7", None, T0 + REPEAT_US)
    assert health.set("one more", "silent", T0 + REPEAT_US) == [fault("one more", "silent")]
    assert len(health.sentences()) == MAX_CONDITIONS
