"""Set-ups on interfaces that a test may make: `check` and `run` in a network of their own."""

from __future__ import annotations

import subprocess

from setup_scenes import Verdict, healthy


def ip(command: str) -> None:
    subprocess.run(["ip", *command.split()], check=True)


def on(interface: str) -> tuple[Verdict, Verdict]:
    with healthy() as setup:
        setup.change(('interface = "127.0.0.1"', f'interface = "{interface}"'))
        return setup.check(), setup.run()


def agree(interface: str, cause: str, remedy: str) -> None:
    checked, ran = on(interface)
    assert checked.code == ran.code == 0
    assert checked.first.startswith(f"cannot join 239.255.76.67 on {interface}: {cause}"), checked
    assert remedy in checked.first, checked
    assert ran.first == checked.first, ran


def main() -> None:
    # what stands there shows the interfaces of the network that was left
    subprocess.run(["mount", "-t", "sysfs", "sysfs", "/sys"], check=True)
    ip("link set lo up")
    ip("link add wlan0 type veth peer name far")
    agree("wlan0", "the interface is down", "ip link set wlan0 up")
    ip("link set wlan0 up")
    ip("link set far up")
    agree("wlan0", "the interface has no IPv4 address", "give it one")
    ip("addr add 192.0.2.3/24 dev wlan0")
    assert on("wlan0") == (Verdict(0, []), Verdict(0, []))
    ip("link set far down")
    checked, ran = on("wlan0")
    assert checked.first.startswith("gossip.interface = 'wlan0': not connected to anything")
    assert ran.code == 0


if __name__ == "__main__":
    main()
