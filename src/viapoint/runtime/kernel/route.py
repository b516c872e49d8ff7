"""The path in program order as the kernel runs it: stretches on one parameter s, places, stops, speeds.

Geometry hands over finished pieces; the route compiles them into axis functions and remembers what
belongs to which motion. It grows at the end and is forgotten from the start. Not here: time.
"""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.axispath import AxisPath
from viapoint.runtime.kernel.failure import JointJump, OutOfReach, PlanningError
from viapoint.runtime.kernel.joints import HELD_TURN, held_turn, leaving_singular, tcp_kinematics
from viapoint.runtime.kernel.leg import Leg
from viapoint.runtime.kernel.programmed import OnPiece, Programmed
from viapoint.runtime.kernel.resolver import Resolved
from viapoint.runtime.kernel.sampling import NearSingular
from viapoint.runtime.kernel.spans import Division
from viapoint.runtime.kernel.speeds import SpeedRule
from viapoint.runtime.kernel.stretch import PathLimits, Stretch
from viapoint.runtime.memo import Memo
from viapoint.runtime.path import Chain, Mark, Move, MoveKind, Piece, Space
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot

_GRID: Final = 33
_NARROWING: Final = 8
"""Places looked at, and how often between two of them: some 1e-12 of the way is left."""

_ATTEMPTS: Final = 2
"""To lead on from a singular pose: after a stop, and after the free joints have turned."""


@dataclass(frozen=True, slots=True)
class _Planned:
    """A motion on the route."""

    resolved: Resolved
    line: int
    tool: int
    frame: int


_Waiting = tuple[Stretch, _Planned]


class Route:
    """Grows with the planner, is read by the generator; s in m (rad along joint moves and pure rotations)."""

    def __init__(self, robot: Robot, q_start: Floats, auxiliary: AuxiliaryAxes) -> None:
        self.axes = AxisPath(robot, q_start, auxiliary)
        self.ends: list[float] = []
        """s at the end of each compiled piece."""
        self.stops: list[float] = [0.0]
        """s of every exact stop known, ascending; the start of the route is one."""
        self.programmed = Programmed()
        self._robot = robot
        self._motions: dict[int, _Planned] = {}
        self._places: dict[int, float] = {}
        self._count = 0  # pieces taken, as the chain counts them
        self._after = {0: 0.0}  # s after the first so many pieces
        self._cut = np.inf  # s where the route was cut off
        self._before: Piece | None = None
        self._waiting: list[_Waiting] = []
        self._floor = 0.0  # no way leads back behind it
        self._configuration: int | None = None
        self._entries: Memo[tuple[int, Floats, Stretch]] = Memo()  # kept so that no id comes again
        self._wall = 0.0  # s before which the path is not travelled back

    @property
    def end(self) -> float:
        """s up to which the route can be travelled."""
        return min(self.axes.length, self._cut)

    @property
    def begin(self) -> float:
        """s from which on the route is kept."""
        return max(self._floor, self.programmed.begin)

    def announce(self, tag: int, resolved: Resolved, line: int, tool: int, frame: int) -> None:
        """Say what motion `tag` is, before its pieces are taken."""
        self._motions[tag] = _Planned(resolved, line, tool, frame)

    def tool_of(self, tag: int) -> int:
        """The tool of motion `tag`."""
        return self._motions[tag].tool

    def rule(self, tag: int) -> SpeedRule:
        """The programmed speeds of motion `tag`."""
        return self._motions[tag].resolved.rule

    def line_of(self, tag: int) -> int:
        """The line of motion `tag`."""
        return self._motions[tag].line

    def take(self, pieces: Sequence[Piece], marks: Sequence[Mark]) -> None:
        """Compile finished pieces onto the end and note where their motions end.

        Raises PlanningError; what was compiled before it stays, but for the motion into a round edge that
        fails: it is not begun.
        """
        before, end = self._count, self._count + len(pieces)
        try:
            for k, piece in enumerate(pieces):
                self._add(piece, pieces[k + 1] if k + 1 < len(pieces) else None)
            self._compile()
        except PlanningError:
            end = before + _whole(pieces, self._count - before)
            self._cut_off(self._after[end])
            raise
        finally:
            self._waiting.clear()
            for mark in marks:
                if mark.pieces <= end:
                    self._places[mark.tag] = self._after[mark.pieces]
            for old in [count for count in self._after if count < self._count - len(pieces)]:
                del self._after[old]

    def _cut_off(self, s: float) -> None:
        """The route ends at s, although more was compiled."""
        self._cut = s
        self.ends = [end for end in self.ends if end <= s]
        self.stops = [stop for stop in self.stops if stop <= s]

    def stop_here(self) -> None:
        """The route is passed with an exact stop at its present end."""
        if self.end > self.stops[-1]:
            self.stops.append(self.end)
        self._configuration = None

    def place(self, tag: int) -> float | None:
        """s where motion `tag` ends and actions after it stand; None while that is not decided."""
        return self._places.get(tag)

    def place_before(self, s: float) -> float:
        """The last place before s at which a motion ends, as far as the route is kept; else its beginning."""
        begin = self.programmed.begin
        return max((place for place in self._places.values() if begin <= place < s), default=begin)

    def place_after(self, s: float) -> float:
        """The first place behind s at which a motion ends, as far as the route is laid; else its end."""
        return min((place for place in self._places.values() if place > s), default=self.end)

    def line_at(self, s: float) -> int:
        """Source line of the motion that leads on from s, 0 where none is kept."""
        ends = ((place, self._motions[tag].line) for tag, place in self._places.items() if place > s)
        return min(ends, default=(s, 0))[1]

    def cut(self, tag: int, s: float) -> float:
        """Motion `tag`, the last one laid, ends at s and not where it leads; s of that place from now on."""
        place = self._places[tag] = self.part(s)
        return place

    def part(self, s: float) -> float:
        """What was laid beyond s is not travelled, the route goes on from there; its s from now on."""
        if self.axes.length > s:
            self.axes.hold(s)
        self._cut = np.inf
        self.stops.append(self.end)
        self.ends.append(self.end)
        self._floor = self.end
        self._configuration, self._before = None, None
        self._count, self._after = 0, {0: self.end}
        return self.end

    def unplace(self, tag: int) -> None:
        """Motion `tag` and those after it are not to be executed: their ends are forgotten."""
        for later in [each for each in self._places if each >= tag]:
            del self._places[later]

    def travelled(self, s: float) -> float:
        """TCP length from the start of the route to s, m."""
        return self.axes.travelled_at(s)

    def reaching(self, travelled: float, s_from: float, s_to: float) -> float:
        """s between two places at which the TCP has travelled so far from the start of the route, m."""
        for _ in range(_NARROWING):
            grid = np.linspace(s_from, s_to, _GRID)
            k = int(np.searchsorted(self.axes.everything(grid)[:, -2], travelled))
            k = min(max(k, 1), _GRID - 1)
            s_from, s_to = float(grid[k - 1]), float(grid[k])
        return s_to

    def next_stop(self, s: float) -> float | None:
        """The first exact stop beyond s, if it is known."""
        k = bisect.bisect_right(self.stops, s)
        return self.stops[k] if k < len(self.stops) else None

    def stop_before(self, s: float) -> float:
        """The last exact stop before s that is still kept, or where the kept route begins."""
        k = bisect.bisect_left(self.stops, s) - 1
        return max(self.stops[k], self.begin, min(self._wall, s)) if k >= 0 else min(self.begin, s)

    def rebase(self, q: Floats) -> None:
        """The path goes on from joints q (n,), at rest; it is not travelled back from there."""
        self.axes.rebase(q)
        self._wall = self.end
        self._configuration = None

    def leg(self, s_from: float, s_to: float) -> Leg | None:
        """What lies between two places; None where pieces do not begin and end there."""
        cells, pieces = self.axes.between(s_from, s_to), self.programmed.whole(s_from, s_to)
        if cells is None or pieces is None:
            return None
        begins, rules = pieces
        return Leg(cells.widths, cells.table, np.searchsorted(cells.starts, begins), rules.copy())

    def speed_bound(self, s: Floats) -> Floats:
        """Programmed bound (N,) on the rate of s."""
        return self.axes.rate_bounds(s, *self.programmed.between(float(s.min()), float(s.max())))

    def speed_ratio(self, before: float, s: Floats, tick: float) -> float:
        """The largest speed ÷ programmed bound in ticks from `before` on to s (N,), which turns nowhere."""
        ends = before, float(s[0]), float(s[-1])
        return self.axes.speed_ratio(before, s, *self.programmed.between(min(ends), max(ends)), tick)

    def forget(self, s: float, tag: int) -> None:
        """Drop what lies before s and the motions before `tag`: the robot will not come back there."""
        self.axes.forget(s)
        self.programmed.forget(s)
        del self.ends[: bisect.bisect_left(self.ends, s)]
        del self.stops[: max(0, bisect.bisect_right(self.stops, s) - 1)]
        for old in [t for t in self._motions if t < tag]:
            del self._motions[old]
            self._places.pop(old, None)

    def _add(self, piece: Piece, following: Piece | None) -> None:
        """Queue a piece; pieces in one configuration are compiled together."""
        motion = self._motions[piece.tag]
        limits = self._path_limits(piece, following)
        stretch = Stretch(piece, motion.resolved.X_tool_flange, motion.line, limits)
        if piece.space is Space.POSE:
            if self._waiting and self._waiting[-1][0].curve.space is Space.JOINT:
                self._compile()
            if self._configuration is None:
                self._compile()
                self._configuration = self._enter(stretch, motion)
        self._waiting.append((stretch, motion))
        self._before = piece
        if piece.stop:
            self._compile()
            self.stop_here()

    def _compile(self) -> None:
        """Compile the queued pieces: together as far as they are ordinary, else one after the other."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        for stretch, motion in waiting[self._together(waiting) :]:
            self._follow(stretch, motion)
        if waiting[-1][0].curve.space is Space.JOINT:
            self._configuration = None

    def _together(self, waiting: Sequence[_Waiting]) -> int:
        """Compile pieces in one batch; how many of them, from the first one on, are ordinary enough."""
        at_rest, done = self.end <= self.stops[-1], 0
        try:
            stretches = [stretch for stretch, _ in waiting]
            laid = self.axes.extend(stretches, self._configuration or 0, at_rest=at_rest)
            done = len(laid.places) - 1
            self._note(laid.places, waiting[:done])
            if laid.fault is not None:
                raise laid.fault
        except NearSingular as near:
            return self._together(waiting[: near.before]) if near.before else 0
        except (JointJump, OutOfReach):
            pass  # followed by itself, the piece may be led into otherwise, or says where it fails
        return done

    def _follow(self, stretch: Stretch, motion: _Planned) -> None:
        """Compile one piece, through or past singular poses. Where nothing continuous leads on from one, the
        robot stops and its free joints turn first.
        """
        posed = stretch.curve.space is Space.POSE
        if posed and self._configuration is None:
            self._configuration = self._enter(stretch, motion)
        start, division = self._led_on(stretch, motion)
        self._note([start, self.end], [(stretch, motion)])
        if division.stop_before and start > self.stops[-1]:
            self.stops.append(start)
        self._configuration = division.configuration if posed else None
        if division.stop_after:
            self.stop_here()

    def _led_on(self, stretch: Stretch, motion: _Planned) -> tuple[float, Division]:
        """One piece put onto the end, and s where it begins: behind a stop, or a turn, if it takes one."""
        for _ in range(_ATTEMPTS):
            start = self.end
            try:
                return start, self._divided(stretch)
            except JointJump as jump:
                if jump.place > 0.0:
                    raise
                if start > self.stops[-1]:
                    self.stop_here()
                    self._configuration = self._enter(stretch, motion)
                    continue
                q = self.axes.q_end
                if (turned := held_turn(self._robot, q, jump)) is None:
                    raise
                self._turn_in_place(motion, stretch.curve.tag, q, turned)
        return self.end, self._divided(stretch)

    def _divided(self, stretch: Stretch) -> Division:
        rest = self.end <= self.stops[-1], stretch.curve.stop
        return self.axes.follow(stretch, self._configuration or 0, rest)

    def _note(self, places: Sequence[float], laid: Sequence[_Waiting]) -> None:
        """Pieces lie from each of the places to the next."""
        ends = places[1:]
        if ends:
            pieces = [
                OnPiece(motion.resolved.rule, self._is_joint(stretch.curve), motion.frame)
                for stretch, motion in laid
            ]
            self.programmed.append(places[:-1], pieces)
        self._after.update(enumerate(ends, self._count + 1))
        self._count += len(ends)
        self.ends += ends

    def _is_joint(self, piece: Piece | None) -> bool:
        return piece is not None and self._motions[piece.tag].resolved.move.kind is MoveKind.JOINT

    def _path_limits(self, piece: Piece, following: Piece | None) -> PathLimits:
        if self._is_joint(piece):
            return PathLimits.FREE
        if piece.is_edge and not piece.ends and self._is_joint(self._before):
            return PathLimits.RAMP_IN
        if piece.is_edge and piece.ends and self._is_joint(following):
            return PathLimits.RAMP_OUT
        return PathLimits.APPLY

    def _enter(self, stretch: Stretch, motion: _Planned) -> int:
        """The configuration a path motion starts in; free joints of a singular pose are turned first."""
        q, preferred = self.axes.q_end, motion.resolved.configuration
        configuration, q_leaving, _ = self._entries.get(
            (stretch.key, q.tobytes(), preferred),
            lambda: (*leaving_singular(self._robot, stretch, q, preferred), stretch),
        )
        if np.abs(q_leaving - q).max() > HELD_TURN:
            self.stop_here()
            self._turn_in_place(motion, stretch.curve.tag, q, q_leaving)
        return configuration

    def _turn_in_place(self, motion: _Planned, tag: int, q: Floats, q_target: Floats) -> None:
        """The TCP is held while the free joints turn to where the path continues (an exact stop follows)."""
        move = motion.resolved.move
        turn = Move(
            kind=MoveKind.JOINT,
            tag=tag,
            start=move.start,
            target=move.start,
            q_start=q,
            q_target=q_target,
            e_start=move.e_start,
            e_target=move.e_start,
            fk=tcp_kinematics(self._robot, motion.resolved.X_flange_tool),
        )
        chain = Chain(tolerance=0.0)
        chain.push(turn)
        chain.close()
        pieces, _, _ = chain.take()
        for piece in pieces:
            start = self.end
            self.axes.follow(
                Stretch(piece, motion.resolved.X_tool_flange, motion.line, PathLimits.FREE), 0, (True, True)
            )
            self.programmed.append([start], [OnPiece(motion.resolved.rule, True, motion.frame)])
            self.ends.append(self.end)
        self.stops.append(self.end)


def _whole(pieces: Sequence[Piece], done: int) -> int:
    """How many of the `done` pieces stay where the next one failed: no line that leads into a round edge."""
    if done < len(pieces) and pieces[done].is_edge:
        done -= 0 if pieces[done].ends else 1  # to its first half
        leads_in = done > 0 and pieces[done - 1].tag == pieces[done].tag and not pieces[done - 1].is_edge
        return done - leads_in
    return done
