"""What the package installs, file by file, and what it tells dpkg."""

from __future__ import annotations

import datetime
import gzip
import os
import re
import shutil
import subprocess
from email.utils import format_datetime
from pathlib import Path

from drslamd import __version__, cli
from lab.package import completion, environment, licences, manual
from lab.package.environment import ROOT

DEBIAN = Path(__file__).with_name("debian")
LIBRARIES = "usr/lib/drslamd"
SHARE = "usr/share/doc/drslamd"
REVISION = f"{__version__}-1"
FROM_SOURCE, PACKAGED = "/opt/drslamd/bin/drslamd", "/usr/bin/drslamd"
"""Where the program is: packages may not write below /opt."""

COPIES = {
    "systemd/drslamd.sysusers": "usr/lib/sysusers.d/drslamd.conf",
    "etc/udev/60-drslamd.rules": "lib/udev/rules.d/60-drslamd.rules",
    "etc/drslamd.toml": f"{SHARE}/examples/drslamd.toml",
    "etc/network/80-can0.network": f"{SHARE}/examples/80-can0.network",
    "etc/network/multicast-route.conf": f"{SHARE}/examples/multicast-route.conf",
    "tools/lab/package/debian/drslamd": "usr/bin/drslamd",
    "tools/lab/package/debian/lintian-overrides": "usr/share/lintian/overrides/drslamd",
}
"""From the repository to the robot."""


def source_epoch() -> int:
    """Seconds that every date of the package tells: of the commit, or of the newest version."""
    if "SOURCE_DATE_EPOCH" in os.environ:
        return int(os.environ["SOURCE_DATE_EPOCH"])
    git = ["git", "-C", str(ROOT), "log", "-1", "--format=%ct"]
    if shutil.which("git") is not None:
        done = subprocess.run(git, capture_output=True, text=True, check=False)
        if done.returncode == 0 and done.stdout.strip():
            return int(done.stdout)
    return int(_released()[0][1].timestamp())


def build(tree: Path, arch: str, epoch: int) -> dict[str, str]:
    """Lay out the package in `tree`; the files of control by their names.

    Raises:
        Unbuilt: something of it cannot be had.
    """
    libraries = tree / LIBRARIES
    environment.install(libraries, arch)
    _write(tree / SHARE / "copyright", licences.take_out(libraries))
    environment.trim(libraries)
    for source, place in COPIES.items():
        _write(tree / place, (ROOT / source).read_text())
    _write(tree / "lib/systemd/system/drslamd@.service", unit())
    (tree / "etc/drslamd").mkdir(parents=True)
    help_in_place(tree, epoch)
    _write_packed(tree / SHARE / "changelog.gz", (ROOT / "tools/CHANGELOG.md").read_text())
    _write_packed(tree / SHARE / "changelog.Debian.gz", changes())
    return _control(tree, arch)


def unit() -> str:
    """The service, whose program and pages are where the package puts them."""
    text = (ROOT / "systemd/drslamd@.service").read_text().replace(FROM_SOURCE, PACKAGED)
    pages = "Documentation=man:drslamd(1) man:drslamd.toml(5)"
    return re.sub("^Documentation=.*$", pages, text, flags=re.MULTILINE)


def help_in_place(tree: Path, epoch: int) -> None:
    """Pages of the manual and completion."""
    pages = manual.pages(cli.parser(), __version__, epoch)
    example = (ROOT / "etc/drslamd.toml").read_text()
    pages["drslamd.toml.5"] = manual.configuration_page(example, __version__, epoch)
    for name, text in pages.items():
        _write_packed(tree / f"usr/share/man/man{name[-1]}" / f"{name}.gz", text)
    for place, text in completion.scripts(cli.parser()).items():
        _write(tree / place, text)


def changes() -> str:
    """The newest version in the form that Debian's tools read."""
    version, day = _released()[0]
    return (
        f"drslamd ({version}-1) unstable; urgency=medium\n\n"
        "  * What changed is in changelog.gz, beside this file.\n\n"
        f" -- {_maintainer()}  {format_datetime(day)}\n"
    )


def _released() -> list[tuple[str, datetime.datetime]]:
    """Each version and its day, the newest first."""
    text = (ROOT / "tools/CHANGELOG.md").read_text()
    found = re.findall(r"^## (\S+) - (\d{4}-\d\d-\d\d)$", text, re.MULTILINE)
    utc = datetime.timezone.utc
    return [(v, datetime.datetime.fromisoformat(day).replace(tzinfo=utc)) for v, day in found]


def _maintainer() -> str:
    (said,) = re.findall(r"^Maintainer: (.*)$", (DEBIAN / "control").read_text(), re.MULTILINE)
    return str(said)


def _control(tree: Path, arch: str) -> dict[str, str]:
    size = sum(path.stat().st_size for path in tree.rglob("*") if path.is_file())
    about = (
        (DEBIAN / "control")
        .read_text()
        .format(
            version=REVISION,
            arch=arch,
            size=size // 1024,
            libraries=", ".join(sorted(environment.system_packages(tree / LIBRARIES))),
        )
    )
    scripts = {name: (DEBIAN / name).read_text() for name in ("postinst", "prerm", "postrm")}
    return {"control": about, **scripts}


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def _write_packed(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text.encode(), mtime=0))
