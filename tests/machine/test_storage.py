"""Folders in which nothing can be kept, or nobody can ask."""

from __future__ import annotations

from pathlib import Path

import pytest
from daemon_scenes import configured
from host_trees import HostTree
from setup_scenes import give_away, healthy, nobody

from drslamd.cli.parser import load
from drslamd.host.kernel import Host
from drslamd.machine import storage
from drslamd.machine.storage import LEAST_BYTES, state_folder, status_folder


def test_folders_that_can_be_made_are_not_made_by_looking(tmp_path: Path) -> None:
    host, config = HostTree(tmp_path), configured(tmp_path)
    assert [*state_folder(config, host), *status_folder(config, host)] == []
    assert not (tmp_path / "state").exists()
    (tmp_path / "state").mkdir()
    assert [*state_folder(config, host), *status_folder(config, host)] == []
    assert list((tmp_path / "state").iterdir()) == []


@pytest.mark.parametrize(("free", "found"), [(LEAST_BYTES, 0), (LEAST_BYTES - 1, 1)])
def test_a_disk_that_is_nearly_full_is_told_before_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free: int, found: int
) -> None:
    monkeypatch.setattr(storage, "_free_bytes", lambda folder: free)
    findings = list(state_folder(configured(tmp_path), Host()))
    assert len(findings) == found
    assert all(f.check == "disk" and "only 15 MB" in f.cause for f in findings)


def test_a_folder_of_which_nobody_may_make_one_below() -> None:
    with healthy() as setup:
        give_away(setup)
        setup.state.rmdir()
        setup.folder.chmod(0o555)
        with nobody():
            (only, socket) = [
                *state_folder(load(str(setup.config)), Host()),
                *status_folder(load(str(setup.config)), Host()),
            ]
        setup.folder.chmod(0o755)
    assert only.cause.endswith("robot-3.json: Permission denied")
    assert "make it writable, or name another folder in daemon.state_dir" in only.remedy
    assert socket.cause.endswith("drslamd-3.sock: Permission denied")


def test_what_systemd_is_about_to_make_is_not_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    with healthy() as setup:
        setup.change(('state_dir = "STATE"\n', ""))
        setup.folder.chmod(0o555)
        for name, folder in (("STATE_DIRECTORY", "lib"), ("RUNTIME_DIRECTORY", "run")):
            monkeypatch.setenv(name, str(setup.folder / folder))
        config = load(str(setup.config))
        with nobody():
            assert [*state_folder(config, Host()), *status_folder(config, Host())] == []
            monkeypatch.setenv("STATE_DIRECTORY", f"{setup.folder}/elsewhere:{setup.folder}/lib")
            named = config.daemon.model_copy(update={"state_dir": str(setup.folder / "other")})
            other = config.model_copy(update={"daemon": named})
            assert [f.check for f in state_folder(other, Host())] == ["state folder"]
        setup.folder.chmod(0o755)
