"""The validated cell: robot, points, tools, frames, signals and limits, from a TOML file."""

from viapoint.runtime.cell.default import default_cell
from viapoint.runtime.cell.io import signal_fault
from viapoint.runtime.cell.load import CellError, load_cell, load_cells, parse_cell, parse_cells
from viapoint.runtime.cell.model import (
    AuxiliaryAxis,
    Capsule,
    Cell,
    CellIndex,
    Conveyor,
    DefaultSpeed,
    Drives,
    Filter,
    Frame,
    Io,
    OrientationCone,
    PartQueue,
    PathLimits,
    Point,
    Signal,
    SignalKind,
    Tool,
    Zone,
)
from viapoint.runtime.cell.moving import moved_frame, moved_point

__all__ = [
    "AuxiliaryAxis",
    "Capsule",
    "Cell",
    "CellError",
    "CellIndex",
    "Conveyor",
    "DefaultSpeed",
    "Drives",
    "Filter",
    "Frame",
    "Io",
    "OrientationCone",
    "PartQueue",
    "PathLimits",
    "Point",
    "Signal",
    "SignalKind",
    "Tool",
    "Zone",
    "default_cell",
    "load_cell",
    "load_cells",
    "moved_frame",
    "moved_point",
    "parse_cell",
    "parse_cells",
    "signal_fault",
]
