"""Two robots that drove past the same things, as both have told it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from slam_scenes import NOISE, closure, inverted, keyframes, model_of, product, range_item, wander

from drslamd.conventions import Chain, node_chain
from drslamd.slam.graph.measurements import GraphEntry, RangeMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.tables import NO_HEADING
from drslamd.slam.se2 import Array

A, B = Chain(0, 1), Chain(1, 1)
NODES = {node_chain(7): np.array([3.0, -2.0]), node_chain(8): np.array([-4.0, 3.0])}
COUNT = 40


def paths(seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    return wander(rng, COUNT, 0.4), wander(rng, COUNT, 0.4) + [1.0, -2.0, 0.0]


def graph_of(seed: int, nodes: list[Chain], mutual: int) -> PoseGraph:
    """Two drives whose odometry is exact, each in a frame of its own; ranges to all of the nodes,
    and so many to each other."""
    graph, both = PoseGraph(), paths(seed)
    for chain, path in zip((A, B), both, strict=True):
        own = np.array([product(inverted(path[0]), pose) for pose in path])
        own[:, 2] = np.unwrap(own[:, 2])
        n = 10 * np.arange(COUNT) + 1000 * chain.robot
        ranges: list[RangeMeasurement] = []
        told = []
        for k, node in enumerate(nodes):
            metres = np.hypot(*(path[:, :2] - NODES[node]).T)
            ranges += [
                range_item(int(m), node, 0, float(r)) for m, r in zip(n, metres, strict=True)
            ]
            item = closure(k, int(n[-1]), node, 0, (0, 0, 0))
            told.append(replace(item, covariance=(0.04, 0.0, 0.0, 0.04, 0.0, float(NO_HEADING))))
        if chain == A:
            apart = np.hypot(*(both[0] - both[1])[:, :2].T)
            ranges += [
                range_item(10 * k, B, 1000 + 10 * k, float(apart[k]))
                for k in range(COUNT - mutual, COUNT)
            ]
        graph.insert(chain, GraphEntry(0, model_of(NOISE), keyframes(n, own)))
        graph.insert(chain, GraphEntry(1, None, (), tuple(ranges), tuple(told)))
    return graph
