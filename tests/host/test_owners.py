"""Whose a file is, in words."""

from __future__ import annotations

import os
from pathlib import Path

from setup_scenes import NOBODY, give_away, healthy, nobody

from drslamd.host.owners import barrier, denied, group_name, permissions, user_name


def test_owner_group_and_mode_are_named(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("")
    path.chmod(0o640)
    assert permissions(path) == (
        f"owner {user_name()}, group {group_name(path.stat().st_gid)}, mode 0640"
    )
    assert permissions(tmp_path / "nowhere") == ""
    assert group_name(3_999_999_999) == "3999999999"


def test_the_barrier_is_the_first_folder_that_may_not_be_entered_else_the_file() -> None:
    with healthy() as setup:
        give_away(setup)
        closed = setup.folder / "closed"
        (closed / "deep").mkdir(parents=True)
        closed.chmod(0)
        with nobody():
            assert barrier(setup.key) == setup.key
            assert barrier(closed / "deep" / "file") == closed


def test_the_remedy_is_chmod_for_the_owner_and_chown_for_others() -> None:
    with healthy() as setup:
        give_away(setup)
        setup.key.chmod(0)
        with nobody():
            said = denied(setup.key)
            assert said.startswith(f"this is user {user_name()}, and {setup.key} has owner ")
            assert f"mode 0000: chmod u+rX {setup.key}" in said
        if os.getuid() == 0:
            os.chown(setup.key, NOBODY - 1, NOBODY)
            with nobody():
                assert denied(setup.key).endswith("the user that runs drslamd: chown")
