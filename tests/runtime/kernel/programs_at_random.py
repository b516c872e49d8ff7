"""Random programs with the poses they command, worked out beside the kernel from the numbers alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pinocchio as pin

Floats = npt.NDArray[np.float64]
MM, DEG = 1e-3, np.pi / 180.0

LINKS = (
    (pin.JointModelRZ, (0, 0, 650)),
    (pin.JointModelRY, (400, 0, 680)),
    (pin.JointModelRY, (0, 0, 1100)),
    (pin.JointModelRX, (766, 0, 230)),
    (pin.JointModelRY, (345, 0, 0)),
    (pin.JointModelRX, (0, 0, 0)),
)
FLANGE = (244, 0, 0)
"""frigeni6 joint by joint (F table 3-1): axis, and offset before it in mm."""


class Arm:
    """Forward kinematics of frigeni6 by pinocchio, independent of the kernel's."""

    def __init__(self) -> None:
        self._model = pin.Model()
        parent = 0
        for k, (joint, offset) in enumerate(LINKS):
            placement = pin.SE3(np.eye(3), MM * np.array(offset, dtype=float))
            parent = self._model.addJoint(parent, joint(), placement, f"J{k + 1}")
        self._data = self._model.createData()
        self._flange = pose(FLANGE, np.eye(3))

    def flange(self, q: Floats) -> Floats:
        """X_base_flange (4, 4) at joints (6,)."""
        pin.forwardKinematics(self._model, self._data, q)
        return np.asarray(self._data.oMi[6].homogeneous @ self._flange)


def pose(mm: tuple[float, ...] | Floats, R: Floats) -> Floats:
    """(4, 4) from a position in mm and a rotation (3, 3)."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, MM * np.asarray(mm, dtype=float)
    return X


def rotation(a: float, b: float, c: float) -> Floats:
    """Rz(C)·Ry(B)·Rx(A) from degrees."""
    return np.asarray(
        pin.utils.rotate("z", c * DEG) @ pin.utils.rotate("y", b * DEG) @ pin.utils.rotate("x", a * DEG)
    )


TOOLS = {0: np.eye(4), 1: pose((380, 0, 0), np.eye(3)), 2: pose((200, 0, 50), rotation(0, 30, 0))}
FRAMES = {0: np.eye(4), 1: pose((1400, -400, 700), rotation(0, 0, 30))}


@dataclass(frozen=True)
class Step:
    """A commanded motion: TCP poses (4, 4) in the base with the motion's own tool."""

    line: int
    command: str
    tool: int
    start: Floats
    target: Floats
    via: Floats | None = None  # (3,) m


@dataclass
class Programmed:
    """A program, its motions and where the flange ends."""

    lines: list[str] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)
    X_flange: Floats = field(default_factory=lambda: Arm().flange(np.zeros(6)))

    @property
    def text(self) -> str:
        return "\n".join([*self.lines, "END", ""])

    @property
    def line(self) -> int:
        """Number of the line that comes next."""
        return len(self.lines) + 1


def random_program(seed: int) -> Programmed:
    """Three to six statements; about one program in six cannot be reached somewhere."""
    rng = np.random.default_rng(seed)
    program, arm = Programmed(), Arm()
    to_joints(program, arm, rng, around=True)
    kinds: list[Callable[[Programmed, Arm, np.random.Generator], None]] = [
        to_pose, to_pose, to_pose, turn, circle, circle, to_joints, home, output,
    ]  # fmt: skip
    for _ in range(int(rng.integers(3, 7))):
        kinds[int(rng.integers(len(kinds)))](program, arm, rng)
    return program


def home(program: Programmed, arm: Arm, rng: np.random.Generator) -> None:
    add(program, "HOME", "HOME" + speed(rng), 0, arm.flange(np.zeros(6)))


def output(program: Programmed, arm: Arm, rng: np.random.Generator) -> None:
    program.lines.append(f"SET DO{int(rng.integers(1, 9))}")


def to_joints(program: Programmed, arm: Arm, rng: np.random.Generator, *, around: bool = False) -> None:
    q = np.round(rng.uniform(-25, 25, 6)) + np.array([0, 10, 0, 0, 65, 0])
    words = " ".join(f"J{k + 1}={v:g}" for k, v in enumerate(q))
    tail = " F90" if around else speed(rng) + corner(rng)
    add(program, "MJ", f"MJ {words}{tail}", 0, arm.flange(q * DEG))


def to_pose(program: Programmed, arm: Arm, rng: np.random.Generator) -> None:
    command = ("ML", "ML", "ML", "MJ", "MS")[int(rng.integers(5))]
    tool, frame = pick(rng, 3), pick(rng, 2)
    target, words = somewhere(program, rng, tool, frame)
    add(
        program,
        command,
        f"{command} {words}{codes(tool, frame)}{speed(rng)}{corner(rng, command)}",
        tool,
        target,
    )


def turn(program: Programmed, arm: Arm, rng: np.random.Generator) -> None:
    tool = pick(rng, 3)
    abc = angles(rng)
    target = program.X_flange @ TOOLS[tool]
    target[:3, :3] = rotation(*abc)
    add(program, "ML", f"ML {as_words('ABC', abc)}{codes(tool, 0)}{speed(rng)}{corner(rng)}", tool, target)


def circle(program: Programmed, arm: Arm, rng: np.random.Generator) -> None:
    tool, frame = pick(rng, 3), pick(rng, 2)
    target, words = somewhere(program, rng, tool, frame)
    start = program.X_flange @ TOOLS[tool]
    aside = np.cross(target[:3, 3] - start[:3, 3], rng.normal(size=3))
    bulge = rng.uniform(0.05, 0.4) * np.linalg.norm(target[:3, 3] - start[:3, 3])
    middle = 0.5 * (target[:3, 3] + start[:3, 3]) + bulge * aside / np.linalg.norm(aside)
    inside = np.linalg.inv(FRAMES[frame]) @ np.append(middle, 1.0)
    q = np.round(inside[:3] / MM, 1)
    via = (FRAMES[frame] @ np.append(q * MM, 1.0))[:3]
    text = f"MC {words} {as_words(('QX', 'QY', 'QZ'), q)}{codes(tool, frame)}{speed(rng)}{corner(rng)}"
    add(program, "MC", text, tool, target, via)


def add(
    program: Programmed,
    command: str,
    text: str,
    tool: int,
    X_tcp_or_flange: Floats,
    via: Floats | None = None,
) -> None:
    """Append a motion to a TCP pose (with tool 0 that is the flange)."""
    start = program.X_flange @ TOOLS[tool]
    program.steps.append(Step(program.line, command, tool, start, X_tcp_or_flange, via))
    program.lines.append(text)
    program.X_flange = X_tcp_or_flange @ np.linalg.inv(TOOLS[tool])


def somewhere(program: Programmed, rng: np.random.Generator, tool: int, frame: int) -> tuple[Floats, str]:
    """A TCP pose before the robot and its words in a frame; without angles, those of now are kept."""
    base = np.array([rng.uniform(1250, 1800), rng.uniform(-450, 450), rng.uniform(1100, 2100)])
    xyz = np.round((np.linalg.inv(FRAMES[frame]) @ np.append(base * MM, 1.0))[:3] / MM)
    words = as_words("XYZ", xyz)
    if rng.random() < 0.5:
        R = (program.X_flange @ TOOLS[tool])[:3, :3]
        target = FRAMES[frame] @ pose(xyz, np.eye(3))
        target[:3, :3] = R
        return target, words
    abc = angles(rng)
    return FRAMES[frame] @ pose(xyz, rotation(*abc)), f"{words} {as_words('ABC', abc)}"


def angles(rng: np.random.Generator) -> Floats:
    return np.round([rng.uniform(-40, 40), rng.uniform(50, 115), rng.uniform(-40, 40)])


def as_words(names: tuple[str, ...] | str, values: Floats) -> str:
    return " ".join(f"{name}={value:.10g}" for name, value in zip(names, values, strict=True))


def pick(rng: np.random.Generator, count: int) -> int:
    """0 as often as all others together."""
    return 0 if rng.random() < 0.5 else int(rng.integers(1, count))


def codes(tool: int, frame: int) -> str:
    return (f" T{tool}" if tool else "") + (f" Z{frame}" if frame else "")


def speed(rng: np.random.Generator) -> str:
    choice = ("", "F", "F", "FC", "FA")[int(rng.integers(5))]
    return f" {choice}{rng.uniform(80, 1500):.0f}" if choice else ""


def corner(rng: np.random.Generator, command: str = "ML") -> str:
    if command == "MS" or rng.random() < 0.3:
        return ""
    return f" R{rng.uniform(1, 120):.1f}" if rng.random() < 0.85 else " R0"
