"""The speed along the path with its bounds, and what holds it back where.

The bounds are those of speeds: the programmed one, and that which the axes' speed limits leave. Where the
path is slower than both, an acceleration or a jerk holds it back.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.pictures.spans import spans_of
from viapoint.runtime.pictures.style import DASHED, FAINT, INK, LIMIT, SHADE, colour, envelope
from viapoint.runtime.recording.info import RunInfo
from viapoint.runtime.records import Event, EventValue, Floats, Ints, Window

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NOTHING: Final = "-"
"""Where nothing is near its limit, or the run does not say what is."""

_NAMED: Final = {"programmed speed": "#7f93a8", "path": INK, "orientation": "#d0589f", NOTHING: "#c9d1d8"}
_STILL: Final = 1e-6
"""Part of a limit (or m/s) below which a tick stands still: it has no bounds."""

_ROOM: Final = 1.25
"""The panel reaches so far above the fastest tick; bounds beyond are cut off."""

_LABELLED: Final = 0.011
"""Part of the width that a block needs for its line number."""


@dataclass(frozen=True, slots=True)
class Pace:
    """Over the ticks (N,): s and speeds in mm and mm/s, NaN where there is no bound.

    `limiter` are indices into `names`, `ends` the s at which blocks end, `lines` their lines.
    """

    s: Floats
    speed: Floats
    programmed: Floats
    axes: Floats
    limiter: Ints
    names: tuple[str, ...]
    ends: tuple[float, ...]
    lines: tuple[int, ...]

    @classmethod
    def of(cls, info: RunInfo, trace: Window, events: Sequence[Event]) -> Pace:
        """From the ticks and events of a run."""
        paces = [event for event in events if event.kind == "pace"]
        spans = spans_of(events)
        names = _names(info, paces)
        limiter = np.full(len(trace), names.index(NOTHING), dtype=np.int64)
        programmed = np.full(len(trace), np.nan)
        turning, joints = _angular_speed(trace, info.tick_s), _rates(trace.joints, info.tick_s)
        length = np.linalg.norm(joints, axis=1)
        for pace in paces:
            rows = _rows(trace, pace.t, _seconds(pace.data, "t_end"))
            for name, start, end in _spans(pace):
                limiter[_rows(trace, start, end)] = names.index(name)
            programmed[rows] = _asked(pace, trace.speed[rows], turning[rows], length[rows])
        return cls(
            s=trace.s / MM,
            speed=trace.speed / MM,
            programmed=programmed * np.abs(trace.override) / MM,
            axes=_axes_bound(info, trace, joints) / MM,
            limiter=limiter,
            names=names,
            ends=tuple(float(np.interp(span.end, trace.time, trace.s)) / MM for span in spans),
            lines=tuple(span.line for span in spans),
        )


def _names(info: RunInfo, paces: Sequence[Event]) -> tuple[str, ...]:
    """Everything that may hold the speed back: the axes first, in their order."""
    known = [axis.name for axis in (*info.axes, *info.auxiliary)] + list(_NAMED)
    found = dict.fromkeys(name for pace in paces for name, _, _ in _spans(pace))
    return tuple(dict.fromkeys([*known, *found]))


def _spans(pace: Event) -> Iterator[tuple[str, float, float]]:
    """(name, from, to) in s of time."""
    t = pace.t
    for part in str(pace.data.get("limits") or "").split(", "):
        name, _, seconds = part.rpartition(" ")
        if name:
            yield name, t, t + float(seconds)
            t += float(seconds)


def _seconds(data: Mapping[str, EventValue], key: str) -> float:
    value = data.get(key)
    return float(value) if isinstance(value, (int, float)) else 0.0


def _rows(trace: Window, start: float, end: float) -> slice:
    """The ticks after `start` up to `end`."""
    first, last = np.searchsorted(trace.time, (start + 1e-9, end + 1e-9))
    return slice(int(first), int(last))


def _rates(values: Floats, tick_s: float) -> Floats:
    return np.diff(values, axis=0, prepend=values[:1]) / tick_s


def _angular_speed(trace: Window, tick_s: float) -> Floats:
    """(N,) rad/s of the TCP's orientation."""
    steps = np.diff(trace.quaternion, axis=0, prepend=trace.quaternion[:1])
    other = np.abs(np.linalg.norm(steps - 2.0 * trace.quaternion, axis=1))  # q and −q are one orientation
    chord = np.minimum(np.linalg.norm(steps, axis=1), other)
    return np.asarray(4.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)) / tick_s)


def _asked(pace: Event, speed: Floats, turning: Floats, length: Floats) -> Floats:
    """(N,) m/s: the programmed speeds of a block as bounds on the TCP's speed."""
    bound = np.full(len(speed), np.inf)
    kinds = (("linear_mm_s", MM, speed), ("angular_deg_s", DEG, turning), ("joint_deg_s", DEG, length))
    for key, unit, rate in kinds:
        value = pace.data.get(key)
        if isinstance(value, (int, float)):
            bound = np.fmin(bound, speed * value * unit / np.where(rate > _STILL, rate, np.nan))
    return np.where(np.isfinite(bound) & (speed > _STILL), bound, np.nan)


def _axes_bound(info: RunInfo, trace: Window, joints: Floats) -> Floats:
    """(N,) m/s: the TCP's speed if the axis nearest to its speed limit ran at it."""
    shares = np.abs(joints) / np.array([axis.speed for axis in info.axes])
    if info.auxiliary:
        others = _rates(trace.auxiliary, info.tick_s) / np.array([axis.speed for axis in info.auxiliary])
        shares = np.concatenate((shares, np.abs(others)), axis=1)
    share = shares.max(axis=1)
    moving = (share > _STILL) & (trace.speed > _STILL)
    return np.where(moving, trace.speed / np.where(moving, share, 1.0), np.nan)


# --- drawing ------------------------------------------------------------------------------------


def draw_pace(panel: Axes, pace: Pace) -> None:
    """Fill a panel: the speed over s in the colours of what holds it back, its bounds, the blocks."""
    top = max(float(pace.speed.max()), 1.0) * _ROOM
    _blocks(panel, pace)
    _bounds(panel, pace, top)
    _speed(panel, pace)
    panel.set_xlim(0.0, max(float(pace.s[-1]), 1.0))
    panel.set_ylim(0.0, top)
    panel.set_xlabel("path  s  [mm]")
    panel.set_ylabel("TCP speed  [mm/s]")
    panel.grid(visible=False, axis="x")


def _blocks(panel: Axes, pace: Pace) -> None:
    """Shades between the ends of blocks, with their lines above where there is room."""
    width = max(float(pace.s[-1]), 1.0)
    begin = 0.0
    for k, (end, line) in enumerate(zip(pace.ends, pace.lines, strict=True)):
        if k % 2:
            panel.axvspan(begin, end, color=SHADE, linewidth=0, zorder=0)
        if end - begin > _LABELLED * width:
            middle = 0.5 * (begin + end)
            panel.text(
                middle, 1.012, str(line), transform=panel.get_xaxis_transform(), ha="center", fontsize=7,
                color=FAINT,
            )  # fmt: skip
        begin = end


def _bounds(panel: Axes, pace: Pace, top: float) -> None:
    for values, shade, label in (
        (pace.axes, LIMIT, "bound of the axes' speed limits"),
        (pace.programmed, INK, "programmed speed"),
    ):
        rows = envelope(np.nan_to_num(values, nan=2.0 * top))
        shown = np.where(values[rows] < 2.0 * top, values[rows], np.nan)
        panel.plot(pace.s[rows], shown, color=shade, linewidth=0.9, linestyle=DASHED, label=label)


def _speed(panel: Axes, pace: Pace) -> None:
    """One line, in the colour of what holds the speed back; the legend says for how much of the time."""
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    changes = np.flatnonzero(np.diff(pace.limiter)) + 1
    rows = np.union1d(envelope(pace.speed), np.concatenate((changes, changes - 1)).astype(np.int64))
    s, v, code = pace.s[rows], pace.speed[rows], pace.limiter[rows]
    panel.fill_between(s, v, color=FAINT, alpha=0.10, linewidth=0)
    pieces = np.stack((np.stack((s[:-1], v[:-1]), axis=1), np.stack((s[1:], v[1:]), axis=1)), axis=1)
    shades = [_shade(pace.names[k], k) for k in range(len(pace.names))]
    colours = [shades[k] for k in code[1:].tolist()]
    panel.add_collection(LineCollection(list(pieces), colors=colours, linewidths=2.0, capstyle="round"))
    moving = pace.speed > _STILL
    handles, labels = panel.get_legend_handles_labels()
    for k, name in enumerate(pace.names):
        share = float(np.mean(pace.limiter[moving] == k)) if moving.any() else 0.0
        if share > 0.0:
            handles.append(Line2D([], [], color=shades[k], linewidth=3.0))
            labels.append(f"{'nothing at its limit' if name == NOTHING else name}  {share:.0%}")
    panel.legend(
        handles, labels, loc="lower right", bbox_to_anchor=(1.0, 1.06), ncol=len(labels), frameon=False,
        fontsize=8, columnspacing=1.4, handlelength=1.6,
    )  # fmt: skip
    panel.set_title(
        "speed along the path, and what holds it back", loc="left", fontsize=9, color=FAINT, pad=16
    )


def _shade(name: str, index: int) -> str:
    return _NAMED.get(name) or colour(index)
