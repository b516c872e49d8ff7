"""Pictures: written, complete, the same bytes twice; refused with a sentence where nothing can be drawn."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from viapoint.runtime.pictures import PictureError, draw_run
from viapoint.runtime.pictures.spans import spans_of
from viapoint.runtime.recording import PRISMATIC
from viapoint.runtime.records import Event


def test_png_is_written_and_repeats(run, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        draw_run(run.info, run.window, run.events, tmp_path / name)
    data = (tmp_path / "a.png").read_bytes()
    assert data.startswith(b"\x89PNG")
    assert len(data) > 50_000
    assert data == (tmp_path / "b.png").read_bytes()


def test_svg_says_what_is_shown(run, tmp_path: Path) -> None:
    info = dataclasses.replace(
        run.info, axes=(dataclasses.replace(run.info.axes[0], kind=PRISMATIC), *run.info.axes[1:])
    )
    draw_run(info, run.window, run.events, tmp_path / "run.svg")
    text = (tmp_path / "run.svg").read_text()
    for label in ("part.via", "joint position", "[deg, mm]", "acceleration", "TCP speed", "DO1", "DI3", "J6"):
        assert label in text


def test_run_without_events_and_without_movement(run, tmp_path: Path) -> None:
    still = dataclasses.replace(
        run.window,
        joints=np.zeros_like(run.window.joints),
        position=np.zeros_like(run.window.position),
        speed=np.zeros_like(run.window.speed),
    )
    draw_run(run.info, still, (), tmp_path / "still.png")
    assert (tmp_path / "still.png").exists()


def test_nothing_to_draw(make_run, tmp_path: Path) -> None:
    run = make_run(2)
    first = next(iter(run.windows(1)))
    with pytest.raises(PictureError, match="no motion to draw"):
        draw_run(run.info, first, (), tmp_path / "x.png")


def test_unknown_format(run, tmp_path: Path) -> None:
    with pytest.raises(PictureError, match="cannot write"):
        draw_run(run.info, run.window, (), tmp_path / "x.gcode")


def test_an_interrupted_motion_is_shown_before_and_behind_what_interrupted_it() -> None:
    def block(line: int, start: float, end: float) -> Event:
        data = {"t_end": end, "command": "ML"}
        return Event(tick=round(start * 1000), t=start, line=line, kind="block", data=data)

    spans = spans_of([block(1, 0.0, 1.0), block(2, 1.0, 4.0), block(8, 2.0, 2.5), block(9, 2.5, 3.0)])
    told = [(span.line, span.start, span.end) for span in spans]
    assert told == [(1, 0.0, 1.0), (2, 1.0, 2.0), (8, 2.0, 2.5), (9, 2.5, 3.0), (2, 3.0, 4.0)]
