"""viapoint: a robot programming language with its compiler, virtual machine and motion kernel.

    import viapoint as via

    cell = via.load_cell("cell.toml")
    program = via.compile_file("part.via", cell=cell)
    for window in via.Session(cell, program).run():
        ...

The public names, nothing else. Each is imported when it is first used, so that what needs no robot
loads none.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viapoint.calibration import CalibrationError, ToolCalibration, calibrate_frame, calibrate_tool
    from viapoint.checking import CheckReport, check_program
    from viapoint.identification import (
        DynamicsIdentification,
        IdentificationError,
        MotionSamples,
        identify_dynamics,
    )
    from viapoint.interactive import Interactive
    from viapoint.jogging import HeldJog, Jog, JogError, JogSpace
    from viapoint.language.diagnostics import Diagnostic, Severity
    from viapoint.monitoring import Monitor, monitor
    from viapoint.realtime import Punctuality, Sender, SenderError
    from viapoint.report import run_report
    from viapoint.runtime.cell import Cell, CellError, default_cell, load_cell, load_cells
    from viapoint.runtime.kernel import Sensor
    from viapoint.runtime.recording import Recorder, Recording, RecordingError, load_recording
    from viapoint.runtime.records import Event, Window
    from viapoint.runtime.robots import Robot, RobotError, load_robot, robot_names
    from viapoint.runtime.signals import Scenario, ScenarioError, load_scenario
    from viapoint.session import CompileError, Session, Status, compile_file, compile_text
    from viapoint.starting import StartError
    from viapoint.station import Station

__all__ = [
    "CalibrationError",
    "Cell",
    "CellError",
    "CheckReport",
    "CompileError",
    "Diagnostic",
    "DynamicsIdentification",
    "Event",
    "HeldJog",
    "IdentificationError",
    "Interactive",
    "Jog",
    "JogError",
    "JogSpace",
    "Monitor",
    "MotionSamples",
    "Punctuality",
    "Recorder",
    "Recording",
    "RecordingError",
    "Robot",
    "RobotError",
    "Scenario",
    "ScenarioError",
    "Sender",
    "SenderError",
    "Sensor",
    "Session",
    "Severity",
    "StartError",
    "Station",
    "Status",
    "ToolCalibration",
    "Window",
    "calibrate_frame",
    "calibrate_tool",
    "check_program",
    "compile_file",
    "compile_text",
    "default_cell",
    "identify_dynamics",
    "load_cell",
    "load_cells",
    "load_recording",
    "load_robot",
    "load_scenario",
    "monitor",
    "robot_names",
    "run_report",
]

_HOMES = {
    "viapoint.calibration": ("CalibrationError", "ToolCalibration", "calibrate_frame", "calibrate_tool"),
    "viapoint.checking": ("CheckReport", "check_program"),
    "viapoint.identification": (
        "DynamicsIdentification",
        "IdentificationError",
        "MotionSamples",
        "identify_dynamics",
    ),
    "viapoint.interactive": ("Interactive",),
    "viapoint.jogging": ("HeldJog", "Jog", "JogError", "JogSpace"),
    "viapoint.language.diagnostics": ("Diagnostic", "Severity"),
    "viapoint.realtime": ("Punctuality", "Sender", "SenderError"),
    "viapoint.monitoring": ("Monitor", "monitor"),
    "viapoint.report": ("run_report",),
    "viapoint.runtime.cell": ("Cell", "CellError", "default_cell", "load_cell", "load_cells"),
    "viapoint.runtime.kernel": ("Sensor",),
    "viapoint.runtime.recording": ("Recorder", "Recording", "RecordingError", "load_recording"),
    "viapoint.runtime.records": ("Event", "Window"),
    "viapoint.runtime.robots": ("Robot", "RobotError", "load_robot", "robot_names"),
    "viapoint.runtime.signals": ("Scenario", "ScenarioError", "load_scenario"),
    "viapoint.starting": ("StartError",),
    "viapoint.session": ("CompileError", "Session", "Status", "compile_file", "compile_text"),
    "viapoint.station": ("Station",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    home = _HOME_OF.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(home), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
