"""Robots: model, limits, one module per kinematic family, and the library of robot files."""

from viapoint.runtime.robots.library import RobotError, load_robot, robot_names
from viapoint.runtime.robots.model import (
    IkSolutions,
    JointLimits,
    Kinematics,
    Robot,
    SingularityReport,
    Solution,
)

__all__ = [
    "IkSolutions",
    "JointLimits",
    "Kinematics",
    "Robot",
    "RobotError",
    "SingularityReport",
    "Solution",
    "load_robot",
    "robot_names",
]
