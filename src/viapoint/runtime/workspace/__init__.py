"""The workspace: zones, the robot's own body, the tool's cone, and whether a motion keeps clear of them."""

from viapoint.runtime.workspace.monitor import TOUCH, Monitor, Rule, Violation
from viapoint.runtime.workspace.watch import NOTHING, Crossing, Sighting, Watch, grid

__all__ = ["NOTHING", "TOUCH", "Crossing", "Monitor", "Rule", "Sighting", "Violation", "Watch", "grid"]
