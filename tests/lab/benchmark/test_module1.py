"""The peers of module 1 find what is to be found."""

from __future__ import annotations

import numpy as np
import pytest
from lab.benchmark import module1, windows

from drslamd.slam import se2


def test_the_peers_of_module_1_find_the_pose() -> None:
    rng = np.random.default_rng(2)
    for _ in range(3):
        window, a_T_b = windows.window(rng, 200)
        for found in (module1.grid(window), module1.one_seed(window)[0]):
            error = se2.between(a_T_b, found)
            assert np.hypot(*error[:2]) < 1.0
        minimum, cost = module1.polished(window, a_T_b)
        nudged = [module1.polished(window, minimum + step)[1] for step in np.eye(3) * 0.01]
        assert cost == pytest.approx(min(nudged), rel=1e-6)


def test_nine_at_once_answer_what_they_answer_one_by_one() -> None:
    rng = np.random.default_rng(3)
    nine = [windows.window(rng, 50)[0] for _ in range(module1.NINE)]
    one_by_one = module1.apart(nine)
    assert module1.difference(one_by_one, module1.together(nine)) < 1e-12
    assert module1.difference(one_by_one, one_by_one[::-1]) > 1e-3
    for seed, window in zip(module1.nine_seeds(nine), nine, strict=True):
        assert np.allclose(seed, module1.one_seed(window))
