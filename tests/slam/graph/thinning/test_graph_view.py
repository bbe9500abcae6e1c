"""One graph for all: who holds the same entries solves the same problem, bit for bit."""

from __future__ import annotations

import random
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
from long_drives import A, B, Drive, Said, logs
from slam_scenes import BANDED, NOISE, closure, group_of, keyframes, model_of, range_item

from drslamd.conventions import Chain
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.chapters.books import PER_ENTRY
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.thinning import chain_view, thinned_pairs
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.graph.thinning.graph_view import GraphView, Thinning
from drslamd.slam.graph.thinning.pair_view import PairView
from drslamd.slam.optimizer.banded.banded_optimizer import build_problem

MINUTES = 70
EVERYBODY = {0, 1, 2}
DRIVES = [
    Drive(clock=0, breaks=(2_000,)),
    Drive(clock=700_123, stands=(900, 1_700)),
    Drive(clock=45_007, breaks=(300, 3_000), stands=(3_900, 4_000)),
]


def graph_of(entries: list[Said], looks: random.Random | None = None, each: int = 100) -> PoseGraph:
    """The graph of entries that came in this order, while somebody looked at it now and then.

    Args:
        looks: where chance comes from; each: entries between two looks, more or less.
    """
    graph = PoseGraph()
    for origin, entry in entries:
        graph.insert(origin, entry)
        if looks and looks.random() < 1 / each:
            assert len(graph.view.chains) <= len(DRIVES)
    return graph


def differences(one: Any, other: Any, path: str = "") -> list[str]:
    """Where two things are not the same to the last bit."""
    if is_dataclass(one):
        names = [field.name for field in fields(one)]
        return [
            d
            for name in names
            for d in differences(getattr(one, name), getattr(other, name), f"{path}.{name}")
        ]
    if isinstance(one, np.ndarray):
        same = one.shape == other.shape and one.tobytes() == other.tobytes()
        return [] if same else [path]
    if isinstance(one, dict):
        keys = [] if one.keys() == other.keys() else [path]
        both = one.keys() & other.keys()
        return keys + [d for k in both for d in differences(one[k], other[k], f"{path}[{k}]")]
    if isinstance(one, list):
        length = [] if len(one) == len(other) else [path]
        pairs = enumerate(zip(one, other, strict=False))
        return length + [d for k, (a, b) in pairs for d in differences(a, b, f"{path}[{k}]")]
    return [] if one == other else [path]


def parts_of(view: GraphView) -> dict[str, Any]:
    """Everything that a view says, without how it was made."""
    chains = {
        robot: [chain.chain, chain.model, chain.keyframes.rows, chain.links]
        for robot, chain in view.chains.items()
    }
    pairs = [[p.a, p.b, p.ranges, p.moves, p.closures] for p in view.pairs]
    return {"chains": chains, "pairs": pairs, "shifts": view.shifts}


def assert_equal(one: PoseGraph, other: PoseGraph) -> None:
    assert differences(parts_of(one.view), parts_of(other.view)) == []
    assert one.digest(EVERYBODY) == other.digest(EVERYBODY)
    assert team_frame.groups(one) == team_frame.groups(other)
    problems = [build_problem(g, group_of(g), None, BANDED) for g in (one, other)]
    assert differences(problems[0].problem, problems[1].problem) == []


# orders of arrival


def in_log_order(entries: list[Said]) -> list[Said]:
    """One log after the other, as a late joiner may get them."""
    return sorted(entries, key=lambda said: said[0])


def lossy(entries: list[Said], chance: random.Random) -> list[Said]:
    """A third of the entries is lost and repeated later, some of it much later."""
    late = [chance.expovariate(1 / 30) * 3 if chance.random() < 0.3 else 0 for _ in entries]
    order = sorted(range(len(entries)), key=lambda k: k + late[k])
    return [entries[k] for k in order]


def parted(entries: list[Said], chance: random.Random) -> list[Said]:
    """Robot 0 hears nothing of the others for half an hour, then a few of their entries at a time
    while driving goes on; some of them twice."""
    begin, end = len(entries) // 5, 3 * len(entries) // 5
    missed = [said for said in entries[begin:end] if said[0].robot != 0]
    out = entries[:begin] + [said for said in entries[begin:end] if said[0].robot == 0]
    rest = entries[end:]
    while missed or rest:
        out += missed[:12] + rest[:3]
        out += missed[:1] if chance.random() < 0.2 else []
        missed, rest = missed[12:], rest[3:]
    return out


def backwards(entries: list[Said]) -> list[Said]:
    return entries[::-1]


@pytest.mark.parametrize("seed", [1, 2])
def test_the_same_entries_make_the_same_graph_in_whatever_order_they_came(seed: int) -> None:
    chance = random.Random(seed)
    entries = logs(seed, 60 * MINUTES, DRIVES, every=12)
    reference = graph_of(entries)
    assert all(len(chain.parts) > 4 for chain in reference.view.chains.values())
    shuffled = random.Random(seed).sample(entries, len(entries))
    for order in (
        in_log_order(entries),
        lossy(entries, chance),
        parted(entries, chance),
        backwards(entries),
        shuffled,
    ):
        assert_equal(graph_of(order, chance), reference)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 18))
def test_the_same_entries_make_the_same_graph_over_hours(seed: int) -> None:
    chance = random.Random(seed)
    drives = [
        Drive(
            clock=chance.randrange(0, 10**7),
            breaks=tuple(chance.randrange(0, 12_000) for _ in range(chance.randrange(4))),
            stands=(begin := chance.randrange(0, 9_000), begin + chance.randrange(0, 3_000)),
        )
        for _ in range(3)
    ]
    entries = logs(seed, 12_000, drives, every=3)
    reference = graph_of(entries)
    for order in (lossy(entries, chance), parted(entries, chance), in_log_order(entries)):
        assert_equal(graph_of(order, chance, each=400), reference)


def test_a_view_that_was_renewed_all_the_while_is_that_which_is_made_anew() -> None:
    """Also while entries are still lacking."""
    chance = random.Random(5)
    entries = lossy(logs(5, 60 * MINUTES, DRIVES, every=12), chance)
    going_on = PoseGraph()
    for k, (origin, entry) in enumerate(entries):
        going_on.insert(origin, entry)
        if k % 25 == 0:
            going_on.view  # noqa: B018
        if k % 200 == 150:
            anew = graph_of(entries[: k + 1])
            assert differences(parts_of(going_on.view), parts_of(anew.view)) == []


def test_a_graph_that_gave_up_its_oldest_hours_is_that_of_whoever_joins_now(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Twenty minutes are held, of which the late joiner got no more."""
    monkeypatch.setattr("drslamd.slam.graph.timed_rows.HELD_BLOCKS", 20)
    entries = logs(6, 60 * MINUTES, [Drive(), Drive(clock=9_003)], every=6)
    newest = entries[-1][1].seq
    late = [said for said in entries if said[1].seq > newest - 20 * 64 / 6 - 15]
    assert len(late) < len(entries) / 2
    model = [said for said in entries if said[1].model]
    assert_equal(graph_of(entries, random.Random(1)), graph_of(model[-2:] + late))


@pytest.mark.parametrize("seconds", [600, 4_000])
def test_from_different_memories_the_answers_are_the_same(seconds: int) -> None:
    """Robots that solved different parts of a drive before they held the same."""
    entries = _consistent_logs(np.random.default_rng(3), seconds)
    half, most = entries[: len(entries) // 2], in_log_order(entries)[: 3 * len(entries) // 4]
    answers = []
    for memory in (half, most, entries[:-2], []):
        graph = graph_of(memory)
        estimate = BANDED.job(graph, group_of(graph), None, {})() if memory else None
        for origin, entry in entries:
            graph.insert(origin, entry)
        solved = [BANDED.job(graph, group_of(graph), estimate, {})()]
        while not solved[-1].is_final:
            solved.append(BANDED.job(graph, group_of(graph), solved[-1], {})())
        assert 2 <= len(solved) <= 3
        answers.append(solved[-1])
    assert len(answers[0].trajectories[0].n) < seconds / 2 + 1
    for other in answers[1:]:
        for robot, path in answers[0].trajectories.items():
            assert np.abs(path.poses - other.trajectories[robot].poses).max() < 1e-7


def _consistent_logs(rng: np.random.Generator, seconds: int) -> list[Said]:
    """Two robots on circles; ranges with noise, closures now and then."""
    out: list[Said] = []
    for k in range(0, seconds, 2):
        angle = [k / 9, k / 14 + 1]
        true = [np.array([3 * np.cos(a) + 4 * r, 3 * np.sin(a), a]) for r, a in enumerate(angle)]
        seen = [np.array([*(t[:2] - [3 + 4 * r, 0]), t[2]]) for r, t in enumerate(true)]
        frames = [keyframes([10 * k], [s]) for s in seen]
        metres = float(np.hypot(*(true[1] - true[0])[:2]) + rng.normal(0, 0.05))
        away = true[1] - true[0]
        c, s = np.cos(true[0][2]), np.sin(true[0][2])
        pose = (c * away[0] + s * away[1], c * away[1] - s * away[0], away[2])
        closures = (closure(k, 10 * k, B, 10 * k, pose),) if k % 20 == 0 else ()
        out.append((B, GraphEntry(k, None, frames[1])))
        ranged = range_item(10 * k, B, 10 * k, metres)
        out.append((A, GraphEntry(k, None, frames[0], (ranged,), closures)))
    return out


# what the digest covers


@pytest.fixture(scope="module")
def small() -> list[Said]:
    return logs(7, 1_400, [Drive(), Drive(clock=3)], every=2)


def inserted(entries: list[Said], *more: Said) -> int:
    return graph_of([*entries, *more]).digest(EVERYBODY)


def test_a_digest_covers_models_ways_ranges_and_closures(small: list[Said]) -> None:
    """One change each, none of which adds or takes a keyframe, range or closure that stays."""
    origin = Chain(0, 1)
    (pair,) = graph_of(small).view.pairs
    stay = {int(place) // PER_ENTRY for place in pair.ranges.place}
    kept = set(pair.closures.number.tolist())
    old = next(
        e
        for o, e in small
        if o == origin and e.seq > 30 and e.seq in stay
        if e.closures and e.closures[0].number in kept
    )
    inner = next(e for o, e in small if o == origin and e.seq == old.seq + 3)
    # the same place, and a heading that makes a row of its own
    turned = replace(inner.keyframes[0], theta=inner.keyframes[0].theta - 5_000)
    changed = {
        "model": replace(old, seq=900, model=model_of(replace(NOISE, scale=0.02))),
        "way": GraphEntry(900, None, (Keyframe(inner.keyframes[0].n + 3, 0, 9_000, 0, 0),)),
        "turn on the way": GraphEntry(900, None, (turned,)),
        "range": replace(old, ranges=(replace(old.ranges[0], range_m=0.5),)),
        "sigma": replace(old, ranges=(replace(old.ranges[0], sigma_m=0.05),)),
        "arm": replace(old, ranges=(replace(old.ranges[0], q_a=(-9.0, 0.0)),)),
        "pose": replace(
            old, closures=(replace(old.closures[0], a_T_b=(-9.0, 0.0, 0.0)), *old.closures[1:])
        ),
    }
    digests = {"as it was": inserted(small)}
    for name, entry in changed.items():
        digests[name] = inserted(small, (origin, entry))
    later = replace(old, seq=901, ranges=(), closures=tuple(_doubted(c) for c in old.closures))
    digests["covariance"] = inserted(small, (origin, later))
    gone = replace(later, closures=tuple(replace(c, kept=False) for c in old.closures))
    digests["withdrawn"] = inserted(small, (origin, gone))
    assert len(set(digests.values())) == len(digests), digests


def _doubted(item: Any) -> Any:
    return replace(item, covariance=tuple(2 * v for v in item.covariance))


def test_a_digest_is_of_the_robots_that_are_asked_for(small: list[Said]) -> None:
    stranger = (Chain(9, 1), GraphEntry(0, None, (Keyframe(5, 0, 0, 0, 0),)))
    whole, more = graph_of(small), graph_of([*small, stranger])
    assert whole.digest({0, 1}) == more.digest({0, 1})
    assert whole.digest({0, 1, 9}) != more.digest({0, 1, 9})
    assert whole.digest({0}) != whole.digest({1})


def test_sines_of_another_processor_do_not_matter(small: list[Said]) -> None:
    """The last bit of a value that is carried may differ; a digest does not see it."""
    graph = graph_of(small)
    before = graph.digest(EVERYBODY)
    ranges = [part for pair in graph.view.pairs for part in pair.parts]
    links = [part for chain in graph.view.chains.values() for part in chain.parts]
    for part in ranges:
        part.ranges.q_a[:] = np.nextafter(part.ranges.q_a, np.inf)
        part.moves[:] = np.nextafter(part.moves, np.inf)
    for held in links:
        held.links.sums[:] = np.nextafter(held.links.sums, np.inf)
    assert digest_anew(graph) == before
    ranges[0].ranges.q_a[3] += 1e-5
    other = digest_anew(graph)
    assert other != before
    links[0].links.sums[0, 0] += 1e-5
    assert digest_anew(graph) not in (before, other)


def digest_anew(graph: PoseGraph) -> int:
    """With nothing remembered of what was digested before."""
    views: list[PairView | ChainView] = [*graph.view.pairs, *graph.view.chains.values()]
    for each in (*views, *(part for view in views for part in view.parts)):
        for name in ("digest", "digested"):
            vars(each).pop(name, None)
    return graph.digest(EVERYBODY)


# a team in the course of hours


def test_all_chains_of_a_team_are_thinned_in_the_same_moments() -> None:
    entries = logs(8, 1_500, [Drive(), Drive(clock=500_011), Drive(clock=77_777)], every=2)
    graph, before, moments = PoseGraph(), None, 0
    for k, (origin, entry) in enumerate(entries):
        graph.insert(origin, entry)
        if k % 3 == 2 and k > 2_000:
            borders = [chain.recent_n for chain in graph.view.chains.values()]
            if before is not None and borders != before:
                moments += 1
                steps = [new - old for new, old in zip(borders, before, strict=True)]
                assert steps == [160] * 3
            before = borders
    assert moments == pytest.approx((1_500 - 2_000 / 3 * 2) / 16, abs=1)


def test_closures_that_were_thinned_hold_together_what_they_held_together() -> None:
    entries = logs(9, 60 * MINUTES, DRIVES, every=12)
    graph = graph_of(entries)
    pairs = {
        (pair.a.robot, pair.b.robot, *ends)
        for pair in graph.usable()
        for ends in zip(
            _segments(graph, pair.a, pair.closures.a_n),
            _segments(graph, pair.b, pair.closures.b_n),
            strict=True,
        )
        if None not in ends
    }
    found = {(j.a.robot, j.b.robot, j.a.segment, j.b.segment) for j in team_frame.joints(graph)}
    assert found == pairs
    assert len(found) > 5


def _segments(graph: PoseGraph, chain: Chain, n: np.ndarray) -> list[int | None]:
    keyframes_held = graph.chains[chain.robot].keyframes
    at, there = keyframes_held.find(n)
    return [int(keyframes_held.segment[k]) if t else None for k, t in zip(at, there, strict=True)]


# a view that is made in slices


@pytest.mark.parametrize("most", [0.5, 7])
def test_what_comes_while_a_view_is_made_is_in_the_next_one(most: float) -> None:
    """In slices of any size it is the view that is made at once of what was there before."""
    entries = logs(3, 900, DRIVES)
    known, late = entries[:-40], entries[-40:]
    sliced, before, after = graph_of(known), graph_of(known), graph_of(entries)
    made, slices, left = None, 0, iter(late)
    while made is None:
        made, slices = sliced.look(most), slices + 1
        if (said := next(left, None)) is not None:
            sliced.insert(*said)
    for said in left:
        sliced.insert(*said)
    assert slices > 2
    assert differences(parts_of(made.view), parts_of(before.view)) == []
    assert differences(parts_of(sliced.view), parts_of(after.view)) == []
    assert differences(parts_of(before.view), parts_of(after.view)) != []


def test_who_needs_a_view_that_is_being_made_gets_one_of_all_that_is_held() -> None:
    entries = logs(3, 900, DRIVES)
    sliced, whole = graph_of(entries[:-1]), graph_of(entries)
    assert sliced.look(0.5) is None
    sliced.insert(*entries[-1])
    assert differences(parts_of(sliced.view), parts_of(whole.view)) == []
    assert differences(parts_of(sliced.frozen().view), parts_of(whole.view)) == []


def test_all_that_a_digest_takes_long_for_is_done_while_the_view_is_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    view = graph_of(logs(3, 900, DRIVES)).view
    for module in (chain_view, thinned_pairs):
        monkeypatch.setattr(module, "as_digested", lambda values: pytest.fail("in one go"))
    assert view.digest({0, 1, 2}) != view.digest({0, 1})


def test_the_work_of_a_step_has_a_bound_whatever_the_team(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also at a step of time, and where most pairs said nothing."""
    monkeypatch.setattr("drslamd.slam.graph.thinning.graph_view.AT_ONCE", 2)
    monkeypatch.setattr("drslamd.slam.graph.thinning.graph_view.PAIRS_AT_ONCE", 3)
    drives = [Drive(clock=77_777 * k) for k in range(5)]
    graph = PoseGraph()
    for origin, entry in logs(8, 900, drives, every=2):
        graph.insert(origin, entry)
    thinning = Thinning(300)
    first = list(thinning.steps(graph.chains, graph.nodes, graph.usable()))
    # ten pairs with some stretches each, of which two or three are thinned at once
    assert len(first) > 50
    assert max(first) < 10
    again = list(thinning.steps(graph.chains, graph.nodes, graph.usable()))
    assert sum(again) < sum(first) / 2
    third = list(thinning.steps(graph.chains, graph.nodes, graph.usable()))
    # and the fifteen views of the first look are let go one by one
    assert len(third) == len(again) + 15
