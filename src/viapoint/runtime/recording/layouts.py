"""Window layouts for the viewers: one arrangement, written for Foxglove and for Lichtblick.

A 3D view of `/scene`, the joints against their limits, TCP speed, signals and the log.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

from .info import PRISMATIC, Axis

COLOURS = ("#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#76b7b2", "#b07aa1", "#9c755f", "#edc948")
LIMIT_COLOUR = "#888888"


@dataclass(frozen=True, slots=True)
class Panel:
    """A panel by the name each viewer gives it."""

    name: str
    foxglove_type: str
    lichtblick_type: str
    config: dict[str, object]


def _series(path: str, label: str, colour: str) -> dict[str, object]:
    return {
        "value": path,
        "enabled": True,
        "timestampMethod": "receiveTime",
        "label": label,
        "color": colour,
    }


def _scene_panel() -> Panel:
    topics = {"/scene": {"visible": True}, "/tf": {"visible": True}}
    camera = {
        "perspective": True,
        "distance": 5.0,
        "phi": 65.0,
        "thetaOffset": 45.0,
        "targetOffset": [0, 0, 0],
        "target": [0.5, 0.0, 0.8],
        "targetOrientation": [0, 0, 0, 1],
        "fovy": 45,
        "near": 0.05,
        "far": 100,
    }
    config: dict[str, object] = {
        "followTf": "base",
        "followMode": "follow-none",
        "scene": {"transforms": {"axisScale": 0.3, "labelSize": 0.06}},
        "cameraState": camera,
        "topics": topics,
        "layers": {"grid": {"visible": True, "layerId": "foxglove.Grid", "size": 6, "divisions": 12}},
    }
    return Panel("scene", "ThreeDee", "3D", config)


def _joint_panel(axes: tuple[Axis, ...]) -> Panel:
    """Each axis' share of its range: −1 and 1 are the limits, so that all axes share one scale."""
    paths = [
        _series(
            f'/joint_states.joints[:]{{name=="{axis.name}"}}.position.@mul({1 / _largest(axis)!r})',
            f"{axis.name} ÷ limit",
            COLOURS[i % len(COLOURS)],
        )
        for i, axis in enumerate(axes)
    ]
    paths += [_series(value, f"limit {value}", LIMIT_COLOUR) for value in ("-1", "1")]
    return Panel("joints", "Plot", "Plot", {"paths": paths, "showLegend": True, "isSynced": True})


def _largest(axis: Axis) -> float:
    largest = max(abs(axis.lower), abs(axis.upper))
    return largest if math.isfinite(largest) and largest > 0.0 else 1.0


def _speed_panel(axes: tuple[Axis, ...]) -> Panel:
    paths = []
    for i, axis in enumerate(axes):
        unit = "m/s" if axis.kind == PRISMATIC else "rad/s"
        path = f'/joint_states.joints[:]{{name=="{axis.name}"}}.velocity'
        paths.append(_series(path, f"{axis.name} {unit}", COLOURS[i % len(COLOURS)]))
    for limit in sorted({axis.speed for axis in axes}):
        paths += [_series(repr(value), f"limit {value:.3g}", LIMIT_COLOUR) for value in (-limit, limit)]
    return Panel("speeds", "Plot", "Plot", {"paths": paths, "showLegend": True, "isSynced": True})


def _signal_panel() -> Panel:
    paths = [_series("/io.level", "signal", COLOURS[0]), _series("/program.line", "line", COLOURS[1])]
    return Panel("program", "Plot", "Plot", {"paths": paths, "showLegend": True, "isSynced": True})


def _log_panel() -> Panel:
    return Panel("log", "Log", "RosOut", {"topicToRender": "/log"})


def _panels(axes: tuple[Axis, ...]) -> list[Panel]:
    return [_scene_panel(), _joint_panel(axes), _speed_panel(axes), _signal_panel(), _log_panel()]


def foxglove_layout(axes: tuple[Axis, ...]) -> str:
    """The layout as Foxglove imports it."""
    scene, *others = [
        {"type": "panel", "panelType": p.foxglove_type, "title": p.name, "config": p.config, "version": 1}
        for p in _panels(axes)
    ]
    column = {
        "type": "split",
        "direction": "column",
        "items": [{"proportion": 1, "content": panel} for panel in others],
    }
    items = [{"proportion": 3, "content": scene}, {"proportion": 2, "content": column}]
    return json.dumps({"version": 1, "content": {"type": "split", "direction": "row", "items": items}})


def lichtblick_layout(axes: tuple[Axis, ...]) -> str:
    """The layout as Lichtblick imports it."""
    configs = {f"{p.lichtblick_type}!{p.name}": p.config for p in _panels(axes)}
    scene, *others = configs
    layout = {"direction": "row", "first": scene, "second": _stack(others), "splitPercentage": 60}
    return json.dumps(
        {
            "configById": configs,
            "globalVariables": {},
            "userNodes": {},
            "playbackConfig": {"speed": 1},
            "layout": layout,
        }
    )


def _stack(names: list[str]) -> object:
    """Panels below each other, all of one height."""
    if len(names) == 1:
        return names[0]
    return {
        "direction": "column",
        "first": names[0],
        "second": _stack(names[1:]),
        "splitPercentage": 100 / len(names),
    }
