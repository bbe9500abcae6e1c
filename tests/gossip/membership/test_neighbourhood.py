"""Who is in range is looked up once in one moment, and anew in the next."""

from __future__ import annotations

from robot_scenes import RobotScene

from drslamd.conventions import Chain


def near(scene: RobotScene) -> list[Chain]:
    return [peer.chain for peer in scene.robot.neighbourhood.at(scene.utime)]


def test_what_was_found_stays_while_nothing_is_heard_and_no_longer() -> None:
    scene = RobotScene()
    scene.meet(4, ranges_to_us=True)
    with scene.robot.neighbourhood.held():
        assert near(scene) == [Chain(4, 1)]
        scene.meet(5, ranges_to_us=True)
        assert near(scene) == [Chain(4, 1)]
        scene.robot.neighbourhood.look_again()
        assert near(scene) == [Chain(4, 1), Chain(5, 1)]
    scene.meet(6, ranges_to_us=True)
    assert near(scene) == [Chain(4, 1), Chain(5, 1), Chain(6, 1)]


def test_another_moment_is_looked_at_anew() -> None:
    scene = RobotScene()
    scene.meet(4, ranges_to_us=True)
    with scene.robot.neighbourhood.held():
        assert near(scene) == [Chain(4, 1)]
        scene.later(10)
        assert near(scene) == []
