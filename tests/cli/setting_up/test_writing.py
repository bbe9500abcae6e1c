"""Files that a verb makes."""

from __future__ import annotations

import os
import pwd
import stat
from pathlib import Path

import pytest

from drslamd.cli.setting_up import writing
from drslamd.cli.setting_up.writing import give_to_service, write_whole


def test_a_new_file_is_whole_and_everybody_can_read_it(tmp_path: Path) -> None:
    before = os.umask(0o077)
    try:
        write_whole(tmp_path / "3.toml", "text\n", may_replace=False)
    finally:
        os.umask(before)
    assert (tmp_path / "3.toml").read_text() == "text\n"
    assert stat.S_IMODE((tmp_path / "3.toml").stat().st_mode) == 0o644
    assert [p.name for p in tmp_path.iterdir()] == ["3.toml"]


def test_another_file_is_replaced_only_where_it_may_be(tmp_path: Path) -> None:
    path = tmp_path / "3.toml"
    path.write_text("old")
    with pytest.raises(FileExistsError):
        write_whole(path, "new", may_replace=False)
    assert path.read_text() == "old"
    write_whole(path, "new", may_replace=True)
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["3.toml"]


def test_a_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_whole(tmp_path / "none" / "3.toml", "text", may_replace=True)


def test_a_key_that_root_makes_belongs_to_the_service_where_there_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[tuple[int, int]] = []
    monkeypatch.setattr(os, "chown", lambda _, user, group: given.append((user, group)))
    path = tmp_path / "team.key"
    for uid, name in ((1000, "nobody"), (0, "nobody-of-that-name"), (0, "nobody")):
        monkeypatch.setattr(os, "geteuid", lambda uid=uid: uid)
        monkeypatch.setattr(writing, "SERVICE_USER", name)
        give_to_service(path)
    nobody = pwd.getpwnam("nobody")
    assert given == [(nobody.pw_uid, nobody.pw_gid)]
