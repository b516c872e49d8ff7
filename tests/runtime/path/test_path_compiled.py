"""Compiled segments against their twins: every curve with every turn, poses, rates and derivatives."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from both_cores import by_both
from viapoint.runtime.path.bezier import bezier
from viapoint.runtime.path.curves import Arc, Bezier, Straight
from viapoint.runtime.path.segments import PoseSegment, sample
from viapoint.runtime.path.turns import KeyedTurn, UniformTurn

SAME = 1e-12


def segments(seed: int, length: float) -> list[PoseSegment]:
    """Every curve with every turn."""
    draw = np.random.default_rng(seed)

    def orientations(count: int) -> np.ndarray:
        q = draw.normal(size=(count, 4))
        return q / np.linalg.norm(q, axis=1, keepdims=True)

    curves = (
        Straight(draw.normal(size=3), draw.normal(size=3), length),
        Arc(draw.normal(size=3), 0.3, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), length),
        Bezier(draw.normal(size=(4, 3)), length),
        Bezier(draw.normal(size=(6, 3)), length),
    )
    knots = np.array([-0.1 * length, 0.3 * length, 0.7 * length, 1.2 * length])
    turns = (
        UniformTurn(orientations(1)[0], np.zeros(3)),
        UniformTurn(orientations(1)[0], draw.normal(size=3)),
        KeyedTurn(np.array([0.0, length]), orientations(1), 1e-3 * draw.normal(size=(1, 6, 3))),
        KeyedTurn(knots, orientations(3), draw.normal(size=(3, 6, 3))),
    )
    return [PoseSegment(curve, turn) for curve, turn in itertools.product(curves, turns)]


@pytest.mark.parametrize("seed", range(3))
def test_segments(seed: int) -> None:
    print(f"seed {seed}")
    made = segments(seed, 0.6)
    counts = [1 + k % 5 for k in range(len(made))]
    w = np.random.default_rng(seed).uniform(0.0, 0.6, sum(counts))
    w[:2] = 0.0, 0.6
    twin, compiled = by_both(lambda: sample(made, counts, w), "path._curves")
    for a, b in zip((*twin[0], twin[1]), (*compiled[0], compiled[1]), strict=True):
        assert np.abs(a - b).max() <= SAME
    for segment in made:
        jets = by_both(lambda segment=segment: segment.jet(0.37), "path._curves")
        for name in ("position", "velocity", "acceleration", "quaternion", "rate", "rate_change"):
            a, b = (getattr(jet, name) for jet in jets)
            assert np.abs(a - b).max() <= SAME * (1.0 + np.abs(a).max())


@pytest.mark.parametrize(("degree", "axes"), [(2, 1), (3, 3), (5, 7)])
def test_curves_of_any_dimension(degree: int, axes: int) -> None:
    draw = np.random.default_rng(degree)
    controls, t = draw.normal(size=(degree + 1, axes)), draw.uniform(-0.1, 1.1, 40)
    for twin, compiled in zip(*by_both(lambda: bezier(controls, t[::2]), "path._curves"), strict=True):
        assert twin.shape == (20, axes)
        assert np.array_equal(twin, compiled)
