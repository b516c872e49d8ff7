"""The joint filter: F's weights, the delay honoured by actions and barriers, limits, windows, deviation."""

from __future__ import annotations

import numpy as np
import pytest
from command_runs import ON_ORIENTATION, ON_PATH, CommandRun
from path_oracle import LEVER

from session_runs import Run, cell
from session_runs import run as run_text
from viapoint.report import limits_report
from viapoint.runtime.kernel.smoothing import Smoother, gaussian
from viapoint.session import Session

PROGRAM = """MJ P6 F60
ML P1 F300
ML P2 F900 R40
SET DO1
ML P3 R20
WAIT 0.2
SET DO2
M 5
ML P4 F500
"""
WINDOWS = (1, 64, 1024)


def run(ticks: int, window: int = 1024, *, tick: float = 0.001, override: float = 1.0) -> Run:
    filtered = cell(controller=f"tick_s = {tick}\nfilter = {{ ticks = {ticks} }}")
    return run_text(PROGRAM, filtered, window=window, override=override)


def test_weights_are_those_of_the_book() -> None:
    """F 7-55 for N = 10, σ = 0.4, normalised by F 7-57."""
    raw = [np.exp(-0.5 * ((n - 5) / (0.4 * 5)) ** 2) for n in range(11)]
    weights = gaussian(10, 0.4)
    assert weights == pytest.approx(np.array(raw) / sum(raw))
    assert weights[5] / weights[0] == pytest.approx(np.exp(0.5 * 2.5**2))
    assert weights == pytest.approx(weights[::-1])
    assert weights.sum() == pytest.approx(1.0)
    assert list(gaussian(0, 0.4)) == [1.0]


def test_a_step_and_a_ramp_through_the_filter() -> None:
    smoother = Smoother(gaussian(10, 0.4), np.zeros(2))
    rows = np.column_stack((np.ones(40), np.arange(1.0, 41.0)))
    out = smoother.smooth(rows)
    assert out[:11, 0] == pytest.approx(np.cumsum(gaussian(10, 0.4)))
    assert (out[10:, 0] == 1.0).all()
    assert out[20:, 1] == pytest.approx(rows[20:, 1] - 5.0)  # N/2 ticks late


@pytest.mark.parametrize("ticks", [1, 20, 21])
def test_the_length_of_a_window_changes_nothing(ticks: int) -> None:
    first, *others = (run(ticks, window, tick=0.004) for window in WINDOWS)
    assert first.status == "finished"
    for other in others:
        assert other.history == first.history
        assert np.abs(other.joints - first.joints).max() < 1e-9
        assert np.abs(other.column("deviation") - first.column("deviation")).max() < 1e-9


@pytest.mark.parametrize("ticks", [10, 21])
def test_set_points_are_the_planned_ones_convolved(ticks: int) -> None:
    """Up to the first stop; behind it the filtered run waits for the filter."""
    plain, filtered = run(0), run(ticks)
    stop = plain.end_of(1)
    q = np.concatenate((np.tile(plain.joints[0], (ticks, 1)), plain.joints[: stop + 1]))
    weights = gaussian(ticks, 0.4)
    expected = sum(w * q[k : k + stop + 1] for k, w in enumerate(weights))
    until = plain.end_of(1)
    assert np.abs(filtered.joints[:until] - expected[:until]).max() < 1e-12


def test_barriers_wait_until_the_filter_has_settled() -> None:
    """WAIT stands where the robot does: its time begins N ticks after the path has come to rest, per stop."""
    plain, filtered = run(0), run(20)
    moved = np.abs(np.diff(filtered.joints, axis=0)).max(axis=1)
    wait = filtered.events("wait", 6)[0]
    end = round(wait.data["t_end"] / 0.001)
    assert (moved[wait.tick : end] == 0.0).all()
    assert moved[wait.tick - 1] > 0.0
    stops = 4  # P6, P1, P3, P4
    assert len(filtered.joints) - len(plain.joints) == 20 * stops


def test_actions_on_the_path_are_timed_by_the_set_points_as_sent() -> None:
    """SET DO1 stands in the middle of a round edge: half of N ticks later than on the unfiltered path."""
    plain, filtered = run(0), run(20)

    def delay(done: Run) -> int:
        return done.events("output", 4)[0].tick - done.events("block", 3)[0].tick

    assert delay(filtered) - delay(plain) == pytest.approx(10, abs=1)


@pytest.mark.parametrize("override", [1.0, 0.37])
def test_limits_are_kept(override: float) -> None:
    done = run(15, override=override)
    assert done.over_limits() == {}


def test_the_deviation_is_measured_and_reported() -> None:
    """Against the path itself: the nearest point of the unfiltered run is no further than the deviation."""
    filtered = run(40)
    deviation = filtered.column("deviation")
    ticks = run(0).column("position")
    path = np.concatenate([ticks[:-1] + u * np.diff(ticks, axis=0) for u in np.linspace(0, 1, 101)])
    worst = int(np.argmax(deviation))
    distance = np.linalg.norm(path - filtered.column("position")[worst], axis=1).min()
    assert 5e-6 < distance <= deviation[worst] + 1e-9
    feed = filtered.session.kernel.outlet.feed
    assert feed.deviation == deviation.max()
    assert feed.joint_deviation.max() > 0.0
    assert deviation[-1] == 0.0
    assert run(10).session.kernel.outlet.feed.deviation < feed.deviation


class FilteredRun(CommandRun):
    """Random commands while the joints are filtered: what is sent is off the path by what is reported."""

    def may_be_off(self, session: Session) -> tuple[float, float]:
        feed = session.kernel.outlet.feed
        self.most = feed.joint_deviation / self.cell.robot.limits.acceleration
        turned = float(feed.joint_deviation.sum())
        # the nearest place is that in position and orientation together
        return float(np.hypot(feed.deviation, LEVER * turned)) + ON_PATH, turned + ON_ORIENTATION


@pytest.mark.parametrize("seed", range(8))
def test_random_commands_while_filtering(seed: int) -> None:
    """Also while the filter settles at stops: limits, programmed speed, end, outputs as without commands.

    It cuts corners. A joint is off the path, to the second order, by half its curvature along s times the
    variance of s in the window: |q″|·ṡ² is at most what accelerates it and s, each within its limit.
    """
    run = FilteredRun(seed, cell(controller="filter = { ticks = 60 }"))
    wrong = run.check().wrong
    assert not wrong, f"seed {seed}: {wrong}\n{run.describe()}"
    weights = gaussian(60, 0.4)
    variance = float(weights @ (np.arange(61) - 30.0) ** 2) * run.cell.tick**2
    factor = run.cell.emergency_deceleration_factor if run.emergency else 1.0
    assert run.most.max() <= variance * factor, seed


def drop(speeds: tuple[int, int], edge: float) -> str:
    first, second = speeds
    lines = f"MJ P1 F60\nML P2 F{first} R{edge}\nML P3 F{second} R{edge}\n"
    return lines + "MC P4 QX=1900 QY=0 QZ=1500 F300\n"


@pytest.mark.parametrize("controller", ["", 'profile = "sinusoidal"\n'], ids=["s-curve", "sinusoidal"])
@pytest.mark.parametrize("ticks", [16, 80])
@pytest.mark.parametrize("override", [1.0, 0.37])
def test_the_programmed_speed_is_not_passed(ticks: int, override: float, controller: str) -> None:
    """Where two speeds meet, the slower one holds on both sides of the window that spans them.

    Also on the tip of a motion shorter than the window.
    """
    where = cell(controller=f"{controller}filter = {{ ticks = {ticks} }}")
    for text in (
        drop((500, 100), 100.0),
        drop((100, 500), 20.0),
        "MJ P1 F60\nML P2 F300\nML X=1500 Y=400 F50 R0.5\nML Y=402 F20 R0.5\nML Y=500 F400\n",
    ):
        done = run_text(text, where, override=override)
        assert done.status == "finished"
        assert limits_report(done.session)["programmed_speed"] <= 1.0 + 1e-9
        assert not done.over_limits()


def test_holding_the_slower_speed_longer_costs_little() -> None:
    text = drop((500, 100), 100.0)
    plain = run_text(text, cell())
    filtered = run_text(text, cell(controller="filter = { ticks = 16 }"))
    stops = 2
    assert len(filtered.joints) - len(plain.joints) - 16 * stops < 0.01 * len(plain.joints)
