"""What a motion names: tools, frames, points and joints of the cell, as they are by now.

Live points and frames move, searches keep poses, a belt that is followed displaces every frame. Errors name
the line.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Hashable, MutableMapping

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell, Frame, Point
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.records import Floats
from viapoint.runtime.rotations import invert_pose
from viapoint.vm.ports import Motion, Target


class Places:
    """The cell's tools, frames and points, with what was moved or kept while the program ran."""

    def __init__(self, cell: Cell) -> None:
        self.shift: Floats = np.zeros(3)
        """(3,) m of all frames, with the belt that is followed."""
        self._cell = cell
        self._robot = cell.robot
        self._carrier = AuxiliaryAxes.of(cell).carrier
        self._kept: MutableMapping[int, Point] = {}
        """By searches, or moved; the others may be taught at any time."""
        self._moved: dict[int, Frame] = {}

    def adopt(self, other: Places) -> None:
        """Everything is where `other` has it, now and later, but for what is kept here."""
        self._kept = ChainMap({}, other._kept)
        self._moved = other._moved

    def tool(self, index: int, line: int) -> Floats:
        """X_flange_tool (4, 4) of a tool of the cell. Raises PlanningError."""
        tool = self._cell.tools.get(index)
        if tool is None:
            raise PlanningError("E313", f"tool T{index} is not defined in the cell", line)
        return tool.X_flange_tool

    def frame(self, motion: Motion, e: Floats) -> Floats:
        """X_base_frame (4, 4) of a motion's frame, with the base where auxiliary axes e (k,) have taken it.

        Frame 0 goes with the base; the others stand where the cell says.
        """
        frame = self._moved.get(motion.frame) or self._cell.frames.get(motion.frame)
        if frame is None:
            raise PlanningError("E312", f"frame Z{motion.frame} is not defined in the cell", motion.line)
        X_base_frame = frame.X_base_frame.copy()
        X_base_frame[:3, 3] += self.shift
        if motion.frame != 0 and self._carrier is not None:
            X_base_frame[0, 3] -= e[self._carrier]
        return X_base_frame

    def numbers(self, motion: Motion) -> tuple[Hashable, ...]:
        """The numbers behind what a motion names, as they are now. Raises PlanningError.

        And whether they are of frame 0: it goes with the base, another one with the same numbers stands.
        """
        frame = self._moved.get(motion.frame) or self._cell.frames.get(motion.frame)
        named = [self.shift, self.tool(motion.tool, motion.line)]
        named += [] if frame is None else [frame.X_base_frame]
        points: list[Hashable] = []
        for target in (motion.target, motion.via):
            point = None if target is None or target.point is None else self.point(target.point)
            if point is not None:
                named += [array for array in (point.pose, point.joints) if array is not None]
                points.append((point.pose is None, point.auxiliary))
        return motion.frame == 0, *points, *(array.tobytes() for array in named)

    def point(self, index: int) -> Point | None:
        """A point as it is now; None where there is none."""
        return self._kept.get(index) or self._cell.points.get(index)

    def place(self, what: Point | Frame) -> None:
        """A live point or frame is here now."""
        if isinstance(what, Point):
            self._kept[what.index] = what
        else:
            self._moved[what.index] = what

    def keep(self, index: int, motion: Motion, q: Floats, e: Floats) -> None:
        """Point `index` becomes the pose of the TCP in joints q (n,), in the frame of a motion."""
        X_base_tcp = self._robot.fk(q) @ self.tool(motion.tool, motion.line)
        pose = invert_pose(self.frame(motion, e)) @ X_base_tcp
        self._kept[index] = Point(index=index, name=None, pose=pose, joints=None)

    def taught_joints(self, target: Target, motion: Motion) -> Floats | None:
        """Joints of a point taught in joint space; None for another target."""
        if target.point is None:
            return None
        point = self.point(target.point)
        if point is None:
            known = ", ".join(f"P{n}" for n in sorted({*self._cell.points, *self._kept})[:8]) or "none"
            raise PlanningError(
                "E310",
                f"point P{target.point} is not defined in the cell",
                motion.line,
                f"defined are {known}",
            )
        if point.joints is not None and target.joints:
            raise PlanningError(
                "E311",
                f"P{target.point} is taught in joint space, so joint references have no meaning for it",
                motion.line,
                "leave the J parameters out",
            )
        return point.joints

    def references(self, motion: Motion) -> Floats:
        """Joint references (n,), NaN where none is programmed."""
        return self.with_joints(np.full(self._robot.joint_count, np.nan), motion)

    def with_joints(self, q: Floats, motion: Motion) -> Floats:
        """Joints q (n,) with those that a motion names in place of their own."""
        result, count = q.copy(), self._robot.joint_count
        for number, value in motion.target.joints:
            if number > count:
                raise PlanningError(
                    "E315", f"the robot has no joint J{number}: its last is J{count}", motion.line
                )
            result[number - 1] = value * (MM if self._robot.prismatic[number - 1] else DEG)
        return result

    def check_range(self, q: Floats, motion: Motion) -> None:
        """Raises PlanningError where joints q (n,) are outside their ranges."""
        inside = self._robot.limits.contain(q)
        if inside.all():
            return
        joint = int(np.argmin(inside))
        limits = self._robot.limits
        raise PlanningError(
            "E303",
            f"J{joint + 1} = {q[joint] / DEG:.1f} deg is outside its range "
            f"{limits.lower[joint] / DEG:g}…{limits.upper[joint] / DEG:g} deg",
            motion.line,
        )
