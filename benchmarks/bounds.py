"""Two oracles for the duration of a path: without jerk limits (TOPP-RA), and with them (an NLP, by ipopt).

They share nothing with the time law but the path and, to place their nodes, its speeds. The first bounds
from below up to its grid (3e-4 of the duration here); the second is a local optimum, whose limits hold at
nodes a few milliseconds apart. Needs the extra `bench`.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from sections import Floats, Section

Times = tuple[Floats, Floats]
"""A law as s (K,) and t (K,), from 0 on."""

STATIONS = 4000
"""Stations of TOPP-RA, spread evenly in time; so many again are spread evenly along the path."""

JERK_TOLERANCE = 1.05
"""Ticks may exceed jerk limits by this much; the optimum may use it too, so as not to be beaten unfairly."""

NEAR_REST = 0.05
"""Distance of nodes beside a rest end, in times from rest."""

FIRST_SHARE = 0.5
"""Part of the law's x that the solver starts from: inside most limits."""

SOLVER = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.tol": 1e-5,
    "ipopt.acceptable_tol": 1e-4,
    "ipopt.mu_strategy": "adaptive",
}

BESIDE = 1e-9
"""Part of a piece by which one-sided derivatives are read beside a break."""


def acceleration_bound(section: Section, times: Times, stations: int = STATIONS) -> float:
    """Least duration (s) within speed and acceleration limits; `times` is a law to place stations by.

    Raises ArithmeticError if TOPP-RA fails.
    """
    import toppra
    from toppra.algorithm import TOPPRA

    logging.getLogger("toppra").setLevel(logging.ERROR)
    path = _toppra_path(section)
    limits = section.limits
    acceleration = np.column_stack((-limits.acceleration, limits.acceleration))
    constraints = [
        _speed_constraint(section),
        toppra.constraint.JointAccelerationConstraint(
            acceleration, discretization_scheme=toppra.constraint.DiscretizationType.Collocation
        ),
    ]
    grid = _grid(section, times, stations)
    solver = TOPPRA(
        constraints, path, gridpoints=grid, solver_wrapper="seidel", parametrizer="ParametrizeSpline"
    )
    _, speed, _ = solver.compute_parameterization(0.0, 0.0, return_data=False)
    if speed is None or not np.isfinite(speed).all():
        raise ArithmeticError("TOPP-RA found no parametrization")
    x = np.maximum(speed, 0.0)
    return float((2.0 * np.diff(grid) / (x[1:] + x[:-1])).sum())


def _grid(section: Section, times: Times, stations: int) -> Floats:
    """Stations evenly in time and along the path, at the ends of pieces, and finer beside rest."""
    s, moments = times
    even = np.linspace(section.begin, section.end, stations)
    timed = np.interp(np.linspace(0.0, moments[-1], stations), moments, s)
    fine = (even[1] - even[0]) * 0.7 ** np.arange(1, 12)
    grid = np.unique(np.concatenate((even, timed, section.begin + fine, section.end - fine, section.inner())))
    return grid[np.concatenate(([True], np.diff(grid) > 1e-5 * (even[1] - even[0])))]


def _toppra_path(section: Section) -> Any:
    from toppra.interpolator import AbstractGeometricPath

    class Path(AbstractGeometricPath):  # type: ignore[misc]
        @property
        def dof(self) -> int:
            return len(section.limits.speed)

        @property
        def path_interval(self) -> Floats:
            return np.array([section.begin, section.end])

        @property
        def waypoints(self) -> None:
            return None

        def __call__(self, s: Any, order: int = 0) -> Floats:
            at = np.atleast_1d(np.asarray(s, dtype=np.float64))
            q = section.values(at) if order == 0 else section.derivatives(at)[order - 1]
            return q if np.ndim(s) else q[0]

    return Path()


def _speed_constraint(section: Section) -> Any:
    """Speed limits of the axes and the programmed speed, as bounds on ṡ²."""
    from toppra.constraint import ConstraintType
    from toppra.constraint.linear_constraint import LinearConstraint

    class Speed(LinearConstraint):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.dof = len(section.limits.speed)
            self.constraint_type = ConstraintType.CanonicalLinear

        def compute_constraint_params(self, path: Any, gridpoints: Floats, *args: Any) -> Any:
            top = np.minimum(speed_limit(section, gridpoints), 1e6)
            bounds = np.column_stack((np.zeros_like(top), top**2))
            return None, None, None, None, None, None, bounds

    return Speed()


def speed_limit(section: Section, s: Floats) -> Floats:
    """Programmed speed and speed limits of the axes, as a bound (N,) on ṡ."""
    first = np.abs(section.derivatives(s)[0])
    with np.errstate(divide="ignore"):
        axes = np.where(first > 1e-12, section.limits.speed / first, np.inf).min(axis=1)
    return np.minimum(section.bound(s), axes)


@dataclass(frozen=True)
class Optimum:
    """What the NLP found: duration (s), how the solver ended, its number of variables."""

    duration: float
    status: str
    size: int

    @property
    def good(self) -> bool:
        return self.status in ("Solve_Succeeded", "Solved_To_Acceptable_Level")


def optimum(section: Section, times: Times, spacing: float, seconds: float) -> Optimum:
    """Local optimum of the duration within speed, acceleration and jerk limits.

    Direct collocation over s: x = ṡ² and u = s̈ at nodes, u linear between them (so x₊ = x + h (u + u₊)
    exactly), every limit at every node, jerk at both ends of every interval:
    d³q/dt³ = (q′ u′ + 3 q″ u + q‴ x) √x. The first and the last interval, from and to rest, have constant
    jerk: x ~ s^(4/3), u = 2x/3h there. Nodes stand `spacing` s apart in the time of `times` (s, t), a law to
    start from, and at every break. `seconds` limits the solver's time.
    """
    import casadi as ca

    s, guess = _nodes(section, times, spacing)
    h, n = np.diff(s), len(s) - 2  # n inner nodes; at the ends x = 0
    scale = np.maximum(guess, 1e-3 * guess.max())
    u_scale = float((scale / h[1:]).max())
    variables = ca.SX.sym("x", n), ca.SX.sym("u", n)
    x, u = ca.DM(scale) * variables[0], u_scale * variables[1]
    equal = [row / u_scale for row in _dynamics(h, x, u, ca)]
    g = ca.vertcat(*equal, *_rows(section, s, x, u, ca))
    nlp = {"x": ca.vertcat(*variables), "f": _time(h, x, u, ca), "g": g}
    solver = ca.nlpsol("solver", "ipopt", nlp, SOLVER | {"ipopt.max_wall_time": seconds})
    x0 = FIRST_SHARE * guess
    upper = np.ones(g.shape[0])
    lower = -upper
    lower[: n + 1] = upper[: n + 1] = 0.0
    result = solver(
        x0=np.concatenate((x0 / scale, np.gradient(0.5 * x0, s[1:-1]) / u_scale)),
        lbx=np.concatenate((np.full(n, 1e-9), np.full(n, -np.inf))),
        ubx=np.concatenate((_top(section, s)[1:-1] ** 2 / scale, np.full(n, np.inf))),
        lbg=lower,
        ubg=upper,
    )
    return Optimum(float(result["f"]), str(solver.stats()["return_status"]), 2 * n)


def _dynamics(h: Floats, x: Any, u: Any, ca: Any) -> tuple[Any, Any, Any]:
    """What must be zero: how x changes between nodes, and u beside rest."""
    inner, n = ca.DM(h[1:-1]), x.shape[0]
    change = (x[1:] - x[:-1]) / inner - (u[1:] + u[:-1])
    return change, u[0] - 2 * x[0] / (3 * h[0]), u[n - 1] + 2 * x[n - 1] / (3 * h[-1])


def _time(h: Floats, x: Any, u: Any, ca: Any) -> Any:
    """The duration: Simpson's rule of 1/√x over each interval, x in its middle exactly; 3h/√x beside rest."""
    inner, root, n = ca.DM(h[1:-1]), ca.sqrt(x), x.shape[0]
    middle = 0.5 * (x[1:] + x[:-1]) - inner * (u[1:] - u[:-1]) / 4
    between = ca.sum1(inner / 6 * (1 / root[1:] + 1 / root[:-1] + 4 / ca.sqrt(middle)))
    return between + 3 * h[0] / root[0] + 3 * h[-1] / root[n - 1]


def _nodes(section: Section, times: Times, spacing: float) -> tuple[Floats, Floats]:
    """Nodes s (N,) and squared speeds (N-2,) of the law there; its first and last piece are kept.

    Between them u is linear over s, which fits constant jerk badly where time from rest is short: nodes
    stand closer there.
    """
    s, t = times
    clock = np.arange(t[1], t[-2], 1e-4)
    each = np.minimum(spacing, NEAR_REST * np.minimum(clock, t[-1] - clock))
    count = np.concatenate(([0.0], np.cumsum(1e-4 / each)))[:-1]
    inner = section.inner()
    edges = np.concatenate(([s[1]], inner[(inner > s[1]) & (inner < s[-2])], [s[-2]]))
    at = np.interp(np.interp(edges, s, t), clock, count)
    places = [np.linspace(a, b, max(2, round(b - a)) + 1)[:-1] for a, b in pairwise(at)]
    grid = np.interp(np.interp(np.concatenate(places), count, clock), t, s)
    grid = np.unique(np.concatenate(([section.begin], grid, edges, [section.end])))
    grid = grid[np.concatenate(([True], np.diff(grid) > 1e-8))]
    moments = np.interp(grid, s, t)
    speed = np.interp(moments, 0.5 * (t[1:] + t[:-1]), np.diff(s) / np.diff(t))
    return grid, np.maximum(speed[1:-1] ** 2, 1e-12)


def _top(section: Section, s: Floats) -> Floats:
    """Bound on ṡ at the nodes: the smaller one where it jumps."""
    beside = BESIDE * np.diff(s).min()
    return np.minimum(speed_limit(section, s - beside), speed_limit(section, s + beside))


def _rows(section: Section, s: Floats, x: Any, u: Any, ca: Any) -> list[Any]:
    """Acceleration at the inner nodes, jerk at both ends of all intervals, in units of their limits."""
    limits = section.limits
    h, root = np.diff(s)[1:-1], ca.sqrt(x)
    h_rest = s[1] - s[0], s[-1] - s[-2]
    beside = BESIDE * np.diff(s).min()
    first, second, _ = section.derivatives(s[1:-1])
    third_after = section.derivatives(s[1:-1] + beside)[2]
    third_before = section.derivatives(s[1:-1] - beside)[2]
    change = (u[1:] - u[:-1]) / ca.DM(h)
    rows = []
    for k in range(first.shape[1]):
        a, j = limits.acceleration[k], JERK_TOLERANCE * limits.jerk[k]
        if np.abs(first[:, k]).max() < 1e-12:
            continue
        if np.isfinite(a):
            rows.append((ca.DM(first[:, k]) * u + ca.DM(second[:, k]) * x) / a)
        if np.isfinite(j):
            for x_end, rate_end, width in ((x[0], first[0, k], h_rest[0]), (x[-1], first[-1, k], h_rest[1])):
                rows.append(2 * rate_end / (9 * width**2 * j) * x_end**1.5)  # constant jerk from and to rest
            for rate, third, end in (
                (slice(None, -1), third_after, slice(None, -1)),
                (slice(1, None), third_before, slice(1, None)),
            ):
                jerk = (
                    ca.DM(first[rate, k]) * change
                    + 3 * ca.DM(second[rate, k]) * u[end]
                    + ca.DM(third[rate, k]) * x[end]
                ) * root[end]
                rows.append(jerk / j)
    return rows
