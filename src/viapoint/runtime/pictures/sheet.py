"""One picture of a run: the path in space, joints against their limits, TCP speed, statements, signals.

Everything shown comes from the ticks and events.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.pictures.pace import Pace, draw_pace
from viapoint.runtime.pictures.spans import spans_of
from viapoint.runtime.pictures.style import (
    COLOURS,
    FAINT,
    INK,
    LIMIT,
    OFF,
    ON,
    RC,
    SHADE,
    colour,
    envelope,
    limit_line,
)
from viapoint.runtime.recording.export import axis_units
from viapoint.runtime.recording.info import PRISMATIC, RunInfo
from viapoint.runtime.records import Event, Floats, Window

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SPEED_MAP = "viridis"
PATH_POINTS = 2500  # coloured pieces of the path in space
LABELLED_STATEMENTS = 60  # more than this, and line numbers would overlap everywhere
NEAR_LIMIT = 0.15  # share of the plotted span by which it may grow to show a position limit


class PictureError(Exception):
    """The picture cannot be drawn or written; the message is for the user."""


def draw_run(info: RunInfo, trace: Window, events: Sequence[Event], out: Path, *, title: str = "") -> None:
    """Write the picture; the suffix of `out` chooses the format (png, svg, pdf). Raises `PictureError`."""
    import matplotlib as mpl

    if len(trace) < 2:
        raise PictureError("the run has no motion to draw: it ended at t = 0")
    with mpl.rc_context(RC):
        figure = _Sheet(info, trace, tuple(events)).draw(title)
        try:
            out.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(out, dpi=130, metadata=_metadata(out))
        except (OSError, ValueError) as error:
            raise PictureError(f"cannot write {out}: {error}") from error


def _metadata(out: Path) -> dict[str, Any] | None:
    """Nothing of the day and the library: the same run draws the same bytes."""
    match out.suffix.lower():
        case ".png":
            return {"Software": None}
        case ".svg":
            return {"Date": None}
        case ".pdf":
            return {"CreationDate": None}
        case _:
            return None


class _Sheet:
    """The arrangement of one figure; each method fills one panel."""

    def __init__(self, info: RunInfo, trace: Window, events: tuple[Event, ...]) -> None:
        self.info = info
        self.trace = trace
        self.time = trace.time
        self.tick = info.tick_s
        self.end = float(trace.time[-1])
        self.spans = spans_of(events)
        self.events = events
        self.speed: Floats = np.zeros_like(trace.joints)
        self.speed[1:] = np.diff(trace.joints, axis=0) / self.tick
        self.acceleration: Floats = np.zeros_like(trace.joints)
        self.acceleration[1:-1] = np.diff(trace.joints, n=2, axis=0) / self.tick**2

    def draw(self, title: str) -> Figure:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        lanes = self._signals()
        figure = Figure(figsize=(17, 13.5), facecolor="white")
        FigureCanvasAgg(figure)
        rows = figure.add_gridspec(
            2, 1, height_ratios=(3.1, 1), left=0.02, right=0.985, top=0.93, bottom=0.04, hspace=0.19
        )
        grid = rows[0].subgridspec(1, 2, width_ratios=(1, 1.35), wspace=0.13)
        left = grid[0].subgridspec(2, 1, height_ratios=(2.6, 1), hspace=0.1)
        lane_height = min(0.3 + 0.17 * len(lanes), 2.0)
        right = grid[1].subgridspec(5, 1, height_ratios=(0.24, 1.25, 1, 1, lane_height), hspace=0.2)
        strip = figure.add_subplot(right[0])
        panels = [figure.add_subplot(right[i], sharex=strip) for i in range(1, 5)]
        self._statements(strip)
        self._positions(panels[0])
        self._ratio(panels[1], self.speed, [a.speed for a in self.info.axes], "speed  [% of limit]")
        limits = [a.acceleration for a in self.info.axes]
        self._ratio(panels[2], self.acceleration, limits, "acceleration  [% of limit]")
        self._lanes(panels[3], lanes)
        for panel in panels[:-1]:
            self._shade(panel)
            panel.tick_params(labelbottom=False)
        panels[-1].set_xlabel("time  [s]")
        strip.set_xlim(0.0, self.end)
        self._path(figure, figure.add_subplot(left[0], projection="3d"))
        inner = left[1].subgridspec(1, 2, width_ratios=(0.07, 1), wspace=0.0)
        self._tcp_speed(figure.add_subplot(inner[1]))
        below = rows[1].subgridspec(1, 2, width_ratios=(0.03, 1), wspace=0.0)
        draw_pace(figure.add_subplot(below[1]), Pace.of(self.info, self.trace, self.events))
        self._title(figure, title)
        return figure

    def _title(self, figure: Figure, title: str) -> None:
        name = title or self.info.program_name
        figure.text(0.02, 0.968, name, fontsize=17, fontweight="bold")
        length = float(self.trace.s[-1]) / MM
        facts = [
            self.info.robot,
            f"{self.end:.3f} s",
            f"{length:,.1f} mm path",
            f"{sum(event.kind == 'block' for event in self.events)} motions",
            f"{len(self.trace) - 1:,} ticks of {self.tick * 1000:g} ms",
        ]
        text = "   ·   ".join(fact for fact in facts if fact)
        figure.text(0.02, 0.949, text, fontsize=10, color=FAINT)

    # --- space ---

    def _path(self, figure: Figure, panel: Any) -> None:
        from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

        rows = np.unique(np.linspace(0, len(self.trace) - 1, PATH_POINTS).astype(int))
        points = self.trace.position[rows] / MM
        speed = self.trace.speed[rows] / MM
        segments = np.stack((points[:-1], points[1:]), axis=1)
        lines = Line3DCollection(segments, cmap=SPEED_MAP, linewidth=2.2, capstyle="round")
        lines.set_array((speed[:-1] + speed[1:]) / 2)
        lines.set_clim(0.0, max(float(speed.max()), 1.0))
        panel.add_collection3d(lines)
        floor = self._box(panel, points)
        shadow = points.copy()
        shadow[:, 2] = floor
        panel.plot(*shadow.T, color="#c4ccd4", linewidth=0.9, zorder=0)
        panel.scatter(*points[0], s=46, color="white", edgecolor=INK, linewidth=1.4, depthshade=False)
        panel.scatter(*points[-1], s=46, color=INK, depthshade=False)
        self._outputs_on_path(panel)
        panel.set_xlabel("x [mm]", labelpad=7)
        panel.set_ylabel("y [mm]", labelpad=7)
        panel.set_zlabel("z [mm]", labelpad=7)
        panel.view_init(elev=26, azim=-57)
        panel.set_box_aspect((1, 1, 0.82), zoom=0.94)
        for axis in (panel.xaxis, panel.yaxis, panel.zaxis):
            axis.set_pane_color((0.97, 0.975, 0.985, 1.0))
            axis.pane.set_edgecolor("#dfe5ea")
            axis._axinfo["grid"].update(color="#dfe5ea", linewidth=0.6)
            axis.set_major_locator(_few_ticks())
        bar = figure.colorbar(lines, ax=panel, shrink=0.6, pad=-0.02, aspect=28, location="left")
        bar.set_label("TCP speed  [mm/s]", color=INK)
        bar.outline.set_visible(False)

    def _box(self, panel: Any, points: Floats) -> float:
        """Equal scales on all axes around the path; the height of the floor."""
        low, high = points.min(axis=0), points.max(axis=0)
        half = max(float((high - low).max()) / 2, 1.0) * 1.06
        middle = (low + high) / 2
        for setter, centre in zip((panel.set_xlim, panel.set_ylim), middle[:2], strict=True):
            setter(centre - half, centre + half)
        floor = float(middle[2]) - 0.82 * half
        panel.set_zlim(floor, middle[2] + 0.82 * half)
        return floor

    def _outputs_on_path(self, panel: Any) -> None:
        for value, shade in ((True, ON), (False, LIMIT)):
            rows = [
                min(e.tick - self.trace.first_tick, len(self.trace) - 1)
                for e in self.events
                if e.kind == "output" and bool(e.data["value"]) is value
            ]
            if rows:
                at = self.trace.position[rows] / MM
                label = "output on" if value else "output off"
                panel.scatter(*at.T, s=30, marker="^", color=shade, label=label, depthshade=False)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(loc="upper right", frameon=False, fontsize=8)

    # --- time ---

    def _line(self, panel: Axes, values: Floats, colour: str, label: str | None = None) -> None:
        rows = envelope(values)
        panel.plot(self.time[rows], values[rows], color=colour, linewidth=1.3, label=label)

    def _shade(self, panel: Axes) -> None:
        for i, span in enumerate(self.spans):
            if i % 2:
                panel.axvspan(span.start, span.end, color=SHADE, linewidth=0, zorder=0)

    def _statements(self, panel: Axes) -> None:
        """A strip of the motion statements with their lines."""
        panel.set_ylim(0, 1)
        panel.axis("off")
        labelled = len(self.spans) <= LABELLED_STATEMENTS
        for i, span in enumerate(self.spans):
            colour = "#d5dee7" if i % 2 else "#b9c8d6"
            panel.axvspan(span.start, span.end, ymin=0.0, ymax=0.62, color=colour, linewidth=0)
            share = (span.end - span.start) / self.end
            if labelled and share > 0.018:
                text = f"{span.command}\n{span.line}" if share > 0.03 else str(span.line)
                middle = (span.start + span.end) / 2
                panel.text(middle, 0.31, text, ha="center", va="center", fontsize=7, linespacing=1.1)
        panel.text(0.0, 0.74, "statement and line", fontsize=8, color=FAINT)

    def _positions(self, panel: Axes) -> None:
        units = axis_units(self.info.axes)
        values = self.trace.joints / units
        for i, axis in enumerate(self.info.axes):
            self._line(panel, values[:, i], colour(i), axis.name)
        low, high = float(values.min()), float(values.max())
        room = NEAR_LIMIT * max(high - low, 1.0)
        for i, axis in enumerate(self.info.axes):
            for limit in (axis.lower / units[i], axis.upper / units[i]):
                if low - room <= limit <= high + room:
                    panel.axhline(limit, color=colour(i), linewidth=0.9, linestyle=(0, (4, 3)))
        names = sorted({"mm" if axis.kind == PRISMATIC else "deg" for axis in self.info.axes})
        panel.set_ylabel(f"joint position  [{', '.join(names)}]")
        handles, labels = panel.get_legend_handles_labels()
        panel.figure.legend(
            handles,
            labels,
            loc="upper right",
            bbox_to_anchor=(0.99, 0.988),
            ncol=len(labels),
            frameon=False,
            fontsize=10,
        )

    def _ratio(self, panel: Axes, values: Floats, limits: list[float], label: str) -> None:
        """Each axis as a share of its own limit, so that ±100 % is everyone's."""
        shares = 100.0 * values / np.asarray(limits)
        for i in range(shares.shape[1]):
            self._line(panel, shares[:, i], colour(i))
        for limit in (-100.0, 100.0):
            limit_line(panel, limit)
        peak = max(118.0, float(np.abs(shares).max()) * 1.08)
        panel.set_ylim(-peak, peak)
        panel.set_yticks([-100, -50, 0, 50, 100])
        worst = int(np.argmax(np.abs(shares).max(axis=0)))
        top = float(np.abs(shares[:, worst]).max())
        note = f"peak {top:.1f} % ({self.info.axes[worst].name})"
        panel.text(1.0, 1.015, note, transform=panel.transAxes, ha="right", fontsize=8, color=FAINT)
        panel.set_ylabel(label)

    def _tcp_speed(self, panel: Axes) -> None:
        speed = self.trace.speed / MM
        rows = envelope(speed)
        panel.fill_between(self.time[rows], speed[rows], color=COLOURS[0], alpha=0.14, linewidth=0)
        self._line(panel, speed, COLOURS[0])
        override = self.trace.override
        if float(np.ptp(override)) > 0.0 or float(override[0]) != 1.0:
            twin = panel.twinx()
            twin.plot(self.time, 100 * override, color=COLOURS[1], linewidth=1.0)
            twin.set_ylim(0, 105)
            twin.set_ylabel("override  [%]", color=COLOURS[1])
            twin.grid(visible=False)
        limit = self.info.path_speed / MM
        if 0.0 < limit <= 1.6 * float(speed.max()):
            limit_line(panel, limit)
            note = "limit of path moves"
            panel.annotate(note, (0.0, limit), (4, 3), textcoords="offset points", fontsize=8, color=LIMIT)
        self._shade(panel)
        panel.set_xlim(0.0, self.end)
        panel.set_ylim(bottom=0.0)
        panel.set_ylabel("TCP speed  [mm/s]")
        panel.set_xlabel("time  [s]")

    def _signals(self) -> list[str]:
        """Signals with an edge or a read, outputs first, in order of their numbers."""
        names = {str(e.data["signal"]) for e in self.events if e.kind in ("output", "input_read")}
        return sorted(names, key=lambda name: (not name.startswith("DO"), len(name), name))

    def _lanes(self, panel: Axes, signals: list[str]) -> None:
        panel.grid(visible=False, axis="y")
        panel.set_yticks(range(len(signals)), signals)
        panel.set_ylim(len(signals) - 0.4 if signals else 1, -0.6)
        panel.tick_params(axis="y", length=0)
        for row, name in enumerate(signals):
            edges = [e for e in self.events if e.kind == "output" and e.data["signal"] == name]
            if edges:
                self._output_lane(panel, row, edges)
            reads = [e for e in self.events if e.kind == "input_read" and e.data["signal"] == name]
            self._read_marks(panel, row, reads)
        for event in self.events:
            if event.kind == "error":
                panel.axvline(event.t, color=LIMIT, linewidth=1.4)
        if not signals:
            panel.text(
                0.5, 0.5, "no signals", transform=panel.transAxes, ha="center", va="center", color=FAINT
            )

    def _output_lane(self, panel: Axes, row: int, edges: list[Event]) -> None:
        if isinstance(edges[0].data["value"], float):
            self._number_lane(panel, row, edges)
            return
        times = [0.0, *(e.t for e in edges), self.end]
        levels = [not bool(edges[0].data["value"]), *(bool(e.data["value"]) for e in edges)]
        for start, end, level in zip(times, times[1:], levels, strict=False):
            height, colour = (0.56, ON) if level else (0.08, OFF)
            panel.barh(row, end - start, left=start, height=height, color=colour, linewidth=0)

    def _number_lane(self, panel: Axes, row: int, edges: list[Event]) -> None:
        """Steps between the least and the largest value, with the last one written beside it."""
        values = [float(event.data["value"] or 0.0) for event in edges]
        low, high = min(values), max(values)
        heights = [row + 0.28 - 0.56 * (value - low) / ((high - low) or 1.0) for value in values]
        times = [*(e.t for e in edges), self.end]
        panel.step(times, [*heights, heights[-1]], where="post", color=ON, linewidth=1.4)
        panel.annotate(
            f"{values[-1]:g}", (self.end, heights[-1]), (3, -3), textcoords="offset points", fontsize=8
        )

    def _read_marks(self, panel: Axes, row: int, reads: list[Event]) -> None:
        for value, face in ((True, ON), (False, "white")):
            at = [e.t for e in reads if bool(e.data["value"]) is value]
            panel.plot(at, [row] * len(at), "o", markersize=6, markerfacecolor=face, markeredgecolor=ON)


def _few_ticks() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(5)
