"""Chains of Chebyshev cells: a function that is known, and the compiled module against its twin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from both_cores import by_both
from viapoint.runtime.kernel import chebyshev

Floats = npt.NDArray[np.float64]
WIDTHS = np.array([0.05, 0.02, 0.1, 0.01])
STARTS = np.concatenate(([0.0], np.cumsum(WIDTHS)[:-1]))
RATES = np.array([3.0, -7.0, 11.0])


def cells() -> chebyshev.Cells:
    """sin(rate·s) on cells from 0 to 0.18."""
    s = STARTS[:, None] + WIDTHS[:, None] * chebyshev.NODES
    made = chebyshev.Cells(len(RATES))
    made.append(STARTS, WIDTHS, chebyshev.coefficients(np.sin(s[:, :, None] * RATES)))
    return made


def values(s: Floats) -> list[Floats]:
    return cells().evaluate(s, (0, 1, 2, 3))


def test_a_known_function_and_its_derivatives() -> None:
    s = np.linspace(0.0, 0.18, 301)
    angle = s[:, None] * RATES
    exact = np.sin(angle), RATES * np.cos(angle), -(RATES**2) * np.sin(angle), -(RATES**3) * np.cos(angle)
    for found in by_both(lambda: values(s), "kernel._axes"):
        for order, (a, b) in enumerate(zip(found, exact, strict=True)):
            assert np.abs(a - b).max() <= 1e-13 * (1e4**order / 10 ** min(order, 1))


def test_places_in_any_order_and_outside() -> None:
    s = np.array([0.17, 0.0, -1.0, 0.05, 0.0499999, 0.3, 0.06, 0.07])
    twin, compiled = by_both(lambda: values(s), "kernel._axes")
    for a, b in zip(twin, compiled, strict=True):
        assert np.allclose(a, b, rtol=1e-12, atol=1e-12)
    inside = values(np.clip(s, 0.0, STARTS[-1] + WIDTHS[-1]))
    assert np.allclose(compiled[0], inside[0], rtol=0.0, atol=1e-15)


def test_forgotten_cells() -> None:
    made = cells()
    made.forget(0.06)
    s = np.array([0.06, 0.1])
    assert np.array_equal(made.evaluate(s)[0], cells().evaluate(s)[0])


def test_integrals() -> None:
    s = STARTS[:, None] + WIDTHS[:, None] * chebyshev.NODES
    rates = np.cos(s[:, :, None] * RATES)
    exact = (np.sin(s[:, :, None] * RATES) - np.sin(STARTS[:, None, None] * RATES)) / RATES
    for found in by_both(lambda: chebyshev.integrals(rates, WIDTHS), "kernel._axes"):
        assert np.abs(found - exact).max() <= 1e-15


def test_coefficients_of_rounding_are_none() -> None:
    s = chebyshev.NODES[None, :, None]
    straight = 1.0 + 0.3 * s + 1e-15 * np.sin(40.0 * s)
    for found in by_both(lambda: chebyshev.coefficients(straight), "kernel._axes"):
        assert not found[:, 2:].any()
        assert found[0, 1, 0] > 0.1
    for found in by_both(lambda: chebyshev.unrounded_coefficients(straight), "kernel._axes"):
        assert found[:, 2:].any()
