"""The workspace: zones, the robot's own body, the tool's cone, and whether a motion keeps clear of them."""

from viapoint.runtime.workspace.course import Course, grid
from viapoint.runtime.workspace.encounters import Encounters, Meeting
from viapoint.runtime.workspace.monitor import TOUCH, Monitor, Rule, Violation
from viapoint.runtime.workspace.watch import NOTHING, Crossing, Sighting, Sure, Ticks, Watch

__all__ = [
    "NOTHING",
    "TOUCH",
    "Course",
    "Crossing",
    "Encounters",
    "Meeting",
    "Monitor",
    "Rule",
    "Sighting",
    "Sure",
    "Ticks",
    "Violation",
    "Watch",
    "grid",
]
