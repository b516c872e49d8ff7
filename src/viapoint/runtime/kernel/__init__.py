"""The motion kernel: motion buffer, planner, clock, generator. Everything that has a state while running."""

from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.breaks import Start
from viapoint.runtime.kernel.dialogue import Interpreter
from viapoint.runtime.kernel.failure import ExecutionError, MotionError, PlanningError
from viapoint.runtime.kernel.jogger import Demand
from viapoint.runtime.kernel.kernel import Kernel
from viapoint.runtime.kernel.offsets import Sensor
from viapoint.runtime.kernel.peaks import ratios
from viapoint.runtime.kernel.planner import Corner
from viapoint.runtime.kernel.referencing import referenced
from viapoint.runtime.kernel.states import Command, State
from viapoint.runtime.kernel.zones import ExclusiveZones

__all__ = [
    "AuxiliaryAxes",
    "Command",
    "Corner",
    "Demand",
    "ExclusiveZones",
    "ExecutionError",
    "Interpreter",
    "Kernel",
    "MotionError",
    "PlanningError",
    "Sensor",
    "Start",
    "State",
    "ratios",
    "referenced",
]
