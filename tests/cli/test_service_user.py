"""Root looks as the service's user does, who may read less."""

from __future__ import annotations

import os
import pwd
from pathlib import Path

import pytest
from setup_scenes import healthy

from drslamd import cli
from drslamd.cli import service_user
from drslamd.cli.exit_codes import BAD_CONFIG, BUG, OK, USAGE
from drslamd.cli.service_user import as_user, user_of_service

as_root = pytest.mark.skipif(os.getuid() != 0, reason="only root may look as another user")


@as_root
def test_a_key_that_root_may_read_and_the_user_may_not_is_refused(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with healthy() as setup:
        assert cli.main(["check", "-c", str(setup.config)]) == OK
        code = cli.main(["check", "-c", str(setup.config), "--user", "nobody"])
        first, *_, verdict = capfd.readouterr().out.splitlines()[1:]
    assert code == BAD_CONFIG
    assert "Permission denied; this is user nobody" in first
    assert verdict.endswith("exit code 78 (looked at as user nobody, as the service runs)")


@as_root
def test_the_configurations_of_the_service_are_looked_at_as_its_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service_user, "SERVICE_FOLDER", tmp_path)
    monkeypatch.setattr(service_user, "SERVICE_USER", "nobody")
    assert user_of_service(str(tmp_path / "3.toml")) == "nobody"
    assert user_of_service(str(tmp_path / "deeper" / "3.toml")) is None
    monkeypatch.setattr(service_user, "SERVICE_USER", "not-installed-here")
    assert user_of_service(str(tmp_path / "3.toml")) is None


@as_root
def test_the_service_has_its_folders_and_its_groups(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(service_user, "SERVICE_USER", "nobody")

    def look() -> int:
        print(os.environ["STATE_DIRECTORY"], os.environ["HOME"], os.geteuid(), os.getgroups())
        return 5

    assert as_user("nobody", look) == 5
    state, home, uid, groups = capfd.readouterr().out.split(" ", 3)
    nobody = pwd.getpwnam("nobody")
    assert (state, home, int(uid)) == ("/var/lib/drslamd", nobody.pw_dir, nobody.pw_uid)
    assert str(nobody.pw_gid) in groups


@as_root
def test_a_bug_while_looking_is_not_swallowed(capfd: pytest.CaptureFixture[str]) -> None:
    assert as_user("nobody", lambda: 1 // 0) == BUG
    assert "ZeroDivisionError" in capfd.readouterr().err


def test_a_user_that_there_is_not_is_wrong_usage(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check", "-c", str(config), "--user", "no-such-user"]
    assert cli.main(arguments) == USAGE
    assert capsys.readouterr().err == "--user no-such-user: there is no such user\n"


def test_who_is_not_root_cannot_look_as_another(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 4321)
    assert as_user("nobody", lambda: 0) == USAGE
    assert "only root may look as another user" in capsys.readouterr().err
