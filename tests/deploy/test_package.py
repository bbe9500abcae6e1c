"""The Debian package: built, read by lintian, installed on a clean Debian 12 that then runs it.

A tree of Debian 12 with nothing but what the package says that it needs is booted in namespaces
(box.sh); there the lines of the first page are typed. inside_package.sh acts, the tests look.
"""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from deploy_helpers import REPOSITORY, lines_on_a_robot
from lab.package import __main__ as package
from lab.package.environment import MACHINES
from lab.package.faults import Unbuilt

from drslamd import __version__

pytestmark = pytest.mark.slow

HERE = Path(__file__).resolve().parent
EPOCH = 1_700_000_000


def need(*programs: str) -> None:
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"no {program} here")


def say(*command: str | Path) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def deb(tmp_path_factory: pytest.TempPathFactory) -> Path:
    need("dpkg-deb", "readelf")
    arch = say("dpkg", "--print-architecture").strip()
    if arch not in MACHINES:
        pytest.skip(f"no package for {arch}")
    folder = tmp_path_factory.mktemp("package")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", str(EPOCH))
        try:
            return package.build(arch, folder)
        except Unbuilt as error:
            if "No matching distribution" in str(error) or "connection" in str(error).lower():
                pytest.skip(f"pip finds no libraries here: {error}")
            raise


@pytest.fixture(scope="module")
def listing(deb: Path) -> dict[str, str]:
    """Mode and owner of every path."""
    lines = (line.split(maxsplit=5) for line in say("dpkg-deb", "--contents", deb).splitlines())
    return {parts[5]: f"{parts[0]} {parts[1]}" for parts in lines}


PLACES = {
    "./usr/bin/drslamd": "-rwxr-xr-x",
    "./usr/lib/drslamd/drslamd/robot.py": "-rw-r--r--",
    "./usr/lib/drslamd/drslamd/lcmtypes/pose_t.lcm": "-rw-r--r--",
    "./lib/systemd/system/drslamd@.service": "-rw-r--r--",
    "./lib/udev/rules.d/60-drslamd.rules": "-rw-r--r--",
    "./usr/lib/sysusers.d/drslamd.conf": "-rw-r--r--",
    "./etc/drslamd/": "drwxr-xr-x",
    "./usr/share/doc/drslamd/examples/drslamd.toml": "-rw-r--r--",
    "./usr/share/doc/drslamd/examples/80-can0.network": "-rw-r--r--",
    "./usr/share/doc/drslamd/copyright": "-rw-r--r--",
    "./usr/share/doc/drslamd/changelog.gz": "-rw-r--r--",
    "./usr/share/doc/drslamd/changelog.Debian.gz": "-rw-r--r--",
    "./usr/share/man/man1/drslamd.1.gz": "-rw-r--r--",
    "./usr/share/man/man1/drslamd-check.1.gz": "-rw-r--r--",
    "./usr/share/man/man5/drslamd.toml.5.gz": "-rw-r--r--",
    "./usr/share/bash-completion/completions/drslamd": "-rw-r--r--",
    "./usr/share/zsh/vendor-completions/_drslamd": "-rw-r--r--",
    "./usr/share/fish/vendor_completions.d/drslamd.fish": "-rw-r--r--",
}


@pytest.mark.parametrize(("place", "mode"), PLACES.items())
def test_each_file_is_where_debian_expects_it(
    listing: dict[str, str], place: str, mode: str
) -> None:
    assert listing[place] == f"{mode} root/root"


def test_nothing_else_lies_outside_the_folders_of_the_package(listing: dict[str, str]) -> None:
    own = ("./usr/lib/drslamd/", "./usr/share/man/", "./usr/share/doc/drslamd/")
    files = {place for place in listing if not place.endswith("/")}
    rest = {place for place in files if not place.startswith(own)}
    assert rest == {place for place in PLACES if not place.endswith("/")} - {
        place for place in PLACES if place.startswith(own)
    } | {"./usr/share/lintian/overrides/drslamd"}
    assert not [place for place in files if place.endswith(".pyc") or "/tests/" in place]


def test_its_name_tells_version_and_processor(deb: Path) -> None:
    field = dict(zip(("Package", "Version", "Architecture"), deb.stem.split("_"), strict=True))
    for name, value in field.items():
        assert say("dpkg-deb", "--field", deb, name).strip() == value


def test_lintian_finds_neither_errors_nor_warnings(deb: Path) -> None:
    need("lintian")
    assert say("lintian", "--allow-root", "--fail-on", "error,warning", deb) == ""


def test_no_path_of_the_builder_is_in_it(deb: Path, tmp_path: Path) -> None:
    say("dpkg-deb", "--extract", deb, tmp_path)
    needles = [str(REPOSITORY), str(deb.parent), sys.prefix]
    for path in (path for path in tmp_path.rglob("*") if path.is_file()):
        data = path.read_bytes()
        assert not [needle for needle in needles if needle.encode() in data], path
    shared = list(tmp_path.rglob("*.so*"))
    assert len(shared) > 50
    searched = re.findall(r"R(?:UN)?PATH.*\[(.+)\]", say("readelf", "-dW", *shared))
    assert searched
    assert all(place.startswith("$ORIGIN") for place in searched)


def test_it_is_the_same_when_it_is_made_again(deb: Path, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", str(EPOCH))
        again = package.build(deb.stem.split("_")[-1], tmp_path)
    assert again.name == deb.name
    assert again.read_bytes() == deb.read_bytes()


# on a robot


@pytest.fixture(scope="module")
def traces(deb: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What inside_package.sh wrote."""
    if os.getuid() != 0:
        pytest.skip("only root can make the namespaces")
    need("mmdebstrap", "unshare")
    robot = tmp_path_factory.mktemp("debian") / "root"
    needed = say("dpkg-deb", "--field", deb, "Depends", "Recommends")
    names = set(re.findall(r"(?:^\w+: |, )([a-z][\w.+-]*)", needed, re.MULTILINE))
    include = f"--include={','.join(sorted({*names, 'iproute2'}))}"
    made = subprocess.run(
        ["mmdebstrap", "--quiet", "--variant=minbase", include, "bookworm", str(robot)],
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    if made.returncode:
        pytest.skip(f"no Debian 12 can be had here: {made.stderr.strip()[-200:]}")
    share = tmp_path_factory.mktemp("box")
    shutil.copy(HERE / "inside_package.sh", share / "inside.sh")
    shutil.copy(deb, share)
    (share / "install").write_text("\n".join(lines_on_a_robot()[0]))
    (share / "trap" / "drslamd").mkdir(parents=True)
    (share / "trap" / "drslamd" / "__init__.py").write_text("raise SystemExit('trapped')\n")
    done = subprocess.run(
        [HERE / "box.sh", share, REPOSITORY, sys.base_prefix, sysconfig.get_path("purelib"), robot],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    shutil.rmtree(robot)
    if not (share / "booted").exists():
        pytest.skip(f"systemd does not boot in a box here: {done.stderr.strip()[-200:]}")
    assert (share / "finished").exists(), (share / "inside.log").read_text()
    return share


def read(path: Path) -> str:
    return path.read_text().strip()


def test_the_service_runs_after_the_lines_of_the_first_page(traces: Path) -> None:
    assert read(traces / "active") == "active", read(traces / "install.log")
    assert read(traces / "enabled") == "enabled"
    assert json.loads(read(traces / "status.json"))["robot"] == 3
    assert read(traces / "status.log") == ""


def test_the_program_runs_and_finds_that_the_service_will_start(traces: Path) -> None:
    assert read(traces / "version") == f"drslamd {__version__}"
    assert "\nverdict: run starts" in read(traces / "install.log")


def test_files_belong_to_whom_the_pages_say(traces: Path) -> None:
    assert read(traces / "modes").splitlines() == [
        "/etc/drslamd 750 root:drslamd",
        "/etc/drslamd/3.toml 644 root:root",
        "/etc/drslamd/team.key 600 drslamd:drslamd",
        "/var/lib/drslamd 700 drslamd:drslamd",
        "/run/drslamd 750 drslamd:drslamd",
        "/usr/bin/drslamd 755 root:root",
        "/usr/lib/drslamd 755 root:root",
    ]


def test_the_user_of_the_service_may_open_serial_ports(traces: Path) -> None:
    assert re.fullmatch(
        r"uid=\d+\(drslamd\) gid=\d+\(drslamd\) groups=\d+\(drslamd\),20\(dialout\)",
        read(traces / "user"),
    )


def test_systemd_finds_nothing_wrong_with_the_unit_and_dpkg_with_the_files(traces: Path) -> None:
    assert read(traces / "verify") == ""
    assert read(traces / "changed_files") == ""


def test_only_its_own_libraries_are_loaded(traces: Path) -> None:
    assert ast.literal_eval(read(traces / "modules")) == {"/usr/lib"}
    assert read(traces / "trapped") == read(traces / "version")
    assert int(read(traces / "compiled")) > 500


def test_an_update_starts_running_robots_anew(traces: Path) -> None:
    before, after = read(traces / "pids").split()
    assert "0" not in (before, after)
    assert before != after


def test_a_purge_leaves_only_what_a_person_wrote(traces: Path) -> None:
    assert read(traces / "active_after") in ("inactive", "failed", "unknown")
    assert read(traces / "left").splitlines() == [
        "/etc/drslamd/3.toml",
        "/etc/drslamd/4.toml",
        "/etc/drslamd/team.key",
    ]
