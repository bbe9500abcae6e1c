"""tools/spy: lcm-spy with drslamd's types, built into a jar.

lcm-spy shows only types that it finds as Java classes on its CLASSPATH. Exit codes: 0 done,
2 wrong usage, 69 a program that is needed is missing (the sentence names the package).
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
MISSING = 69

EXAMPLES = """\
examples:
  tools/spy                                      build the jar and start lcm-spy
  tools/spy --build                              only build out/drslamd-types.jar
  LCM_DEFAULT_URL=udpm://239.255.76.67:7667?ttl=0 tools/spy
"""


class Missing(Exception):
    """A program is not installed."""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(
        prog="tools/spy",
        description="Build the type jar and look at the team's messages with lcm-spy.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--build", action="store_true", help="only build the jar")
    parser.add_argument("--jar", type=Path, default=ROOT / "out" / "drslamd-types.jar")
    options = parser.parse_args(arguments)
    try:
        build(options.jar)
    except Missing as error:
        print(error, file=sys.stderr)
        return MISSING
    print(options.jar)
    if options.build:
        return 0
    environment = {**os.environ, "CLASSPATH": str(options.jar)}
    return subprocess.run([program("lcm-spy")], env=environment, check=False).returncode


def program(name: str, package: str = "") -> str:
    """Path of a program, of the lcm package or of the system.

    Raises:
        Missing: it is not there.
    """
    path = os.pathsep.join([sysconfig.get_path("scripts"), os.environ.get("PATH", "")])
    found = shutil.which(name, path=path)
    if found is None:
        remedy = f"; apt install {package}" if package else "; pip install lcm"
        raise Missing(f"{name} is not installed{remedy}")
    return found


def build(jar: Path) -> None:
    """Generate, compile and pack the Java classes of all types.

    Raises:
        Missing: no JDK, or no lcm package.
    """
    lcm_jar = Path(sysconfig.get_path("purelib")) / "share" / "java" / "lcm.jar"
    if not lcm_jar.exists():
        raise Missing(f"{lcm_jar} is not there; pip install lcm")
    tools = {name: program(name, "default-jdk-headless") for name in ("javac", "jar")}
    types = sorted(str(path) for path in (ROOT / "drslamd" / "lcmtypes").glob("*.lcm"))
    jar.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program("lcm-gen"), "-j", "--jpath", folder, *types], check=True)
        sources = sorted(str(path) for path in Path(folder).rglob("*.java"))
        subprocess.run([tools["javac"], "-nowarn", "-cp", str(lcm_jar), *sources], check=True)
        for source in sources:
            Path(source).unlink()
        subprocess.run(
            [tools["jar"], "cf", str(jar.resolve()), "-C", folder, "drslamd"], check=True
        )


if __name__ == "__main__":
    raise SystemExit(main())
