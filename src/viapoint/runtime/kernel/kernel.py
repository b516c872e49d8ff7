"""The motion kernel: everything that has a state while a program runs, behind submit, advance and events.

Order within a tick: outside answers, then the path advances, then actions whose place was passed, then
barriers, then interpreter and planner, which take no simulated time. Ticks are computed in windows: the
path is evaluated far ahead and committed up to the first tick in which something changes it, so that the
length of a window has no influence on the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.breaks import HERE, Start
from viapoint.runtime.kernel.buffer import Entry, MotionBuffer
from viapoint.runtime.kernel.dialogue import Interpreter
from viapoint.runtime.kernel.failure import ExecutionError, MotionError
from viapoint.runtime.kernel.feed import with_reserve
from viapoint.runtime.kernel.interrupts import Interrupts
from viapoint.runtime.kernel.levels import Grounds
from viapoint.runtime.kernel.offsets import Sensor
from viapoint.runtime.kernel.outlet import Outlet, Present
from viapoint.runtime.kernel.passing import ARRIVED
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.states import Hold, State
from viapoint.runtime.kernel.telemetry import Told
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.kernel.travelling import Travelling
from viapoint.runtime.kernel.unsupported import refusal
from viapoint.runtime.kernel.zones import ExclusiveZones
from viapoint.runtime.records import Event, Window
from viapoint.runtime.signals import SignalWorld
from viapoint.vm.ports import Barrier, End, Failed, Motion


class Kernel(Travelling):
    """Runs calls of an interpreter on the robot of a cell.

    `dialogue` is the interpreter's MotionPort and WorldPort. `advance` moves time on; events go to
    `listener`. Without a `start` the robot stands at home at tick 0.
    """

    def __init__(
        self,
        cell: Cell,
        world: SignalWorld,
        listener: Callable[[Event], None],
        *,
        override: float = 1.0,
        stepping: bool = False,
        patient: bool = False,
        start: Start | None = None,
        zones: ExclusiveZones | None = None,
        sensors: Sequence[Sensor] = (),
    ) -> None:
        start = start or Start.at_home(cell)
        self.cell = cell = start.placed(cell)
        self.world = world
        self.state = State.READY
        self.failure: MotionError | None = None
        self.trace = Trace(listener, cell.tick, cell.number)
        self.trace.tick = start.tick
        self.interrupts = Interrupts(world)
        self._stepping = stepping
        buffer = MotionBuffer(cell.lookahead)
        planner = Planner(cell, buffer, start.joints, tool=start.tool, stepping=stepping)
        self.outlet = Outlet(cell, planner, self.trace, start.joints, world, sensors)
        self.telemetry, self.guard = self.outlet.telemetry, self.outlet.guard
        self._grounds = Grounds(
            cell=cell,
            timed=with_reserve(cell, world.scenario, sensors),
            world=world,
            trace=self.trace,
            outlet=self.outlet,
            interrupts=self.interrupts,
            zones=zones,
            patient=patient,
            travelled_mm=self._travelled_mm,
            next_pause=self._next_pause,
            execute=self._execute,
        )
        self._take_up(self._grounds.level(planner, buffer, override or 1.0))
        self.execution.tool = start.tool
        self.execution.track, self.planner.tracks = self.track, True
        self._paused = override == 0.0
        self._awake = start.tick > 0  # tick 0 is done

    # --- running -----------------------------------------------------------------------------------

    @property
    def tick(self) -> int:
        """The tick computed last."""
        return self.trace.tick

    @property
    def tool(self) -> int:
        """The tool the robot has."""
        return self.execution.tool

    @property
    def line(self) -> int:
        """Source line the path is in."""
        return self.execution.line

    @property
    def line_here(self) -> int:
        """Source line of the motion where the robot is, also when it went back."""
        return self.planner.route.line_at(self.mover.s + HERE) if self.astray else self.line

    @property
    def fill(self) -> int:
        """Entries in the motion buffer."""
        return self._buffer.fill

    def begin(self, interpreter: Interpreter) -> Window:
        """Take the program on; returns tick 0, after all that happens in it, or else the next tick."""
        self.dialogue.open(interpreter)
        window = None if self._awake else self._wake()
        self.take_on(interpreter)
        return self.advance(1) if window is None else window

    def _wake(self) -> Window:
        """Tick 0: the robot stands where it begins."""
        self._awake = True
        self.world.advance(0)
        return self.telemetry.standing(0, 1, self._told, self._now.status)

    def take_on(self, interpreter: Interpreter, steps: int | None = None) -> None:
        """Take a program on where the robot stands, when none is under way: time, path and signals go on.

        With `steps` the robot halts when so many statements have been executed.
        """
        self.dialogue.open(interpreter)
        self._hold = Hold.NONE if self.over else self._hold
        self.execution.ended, self.state, self._awake = False, State.READY, True
        self.execution.begin(interpreter.modal)
        self.interrupts.clear()
        self.breaks.begin(steps)
        refused: MotionError | None = refusal(self.cell)
        refused = refused or self.outlet.room_for(self.tool, 0) or self._taken()
        if refused is not None:
            self.fail(refused)
        else:
            self._settle()

    def advance(self, ticks: int) -> Window:
        """Let at least one and at most `ticks` ticks pass; ends early where something happens."""
        self.execution.blocks.forget()
        if self.outlet.feed.failure is not None and not self.outlet.feed.down:
            return self._let_down(ticks)
        if self.state is State.MOVING:
            return self._move(ticks)
        if self.state is State.JOGGING:
            return self._jog(ticks) if self._awake else self._wake()
        return self._stand(ticks)

    def _stand(self, ticks: int) -> Window:
        first = self.tick + 1
        last = self.tick + ticks
        if self.execution.dwell_until is not None and not self.over:
            last = min(last, max(self.execution.dwell_until, first))
        change = first if self.state is State.POLLING else self.world.next_change(self.tick)
        for tick in (change, self.dialogue.deadline, self.execution.pulses.next_end):
            if tick is not None:
                last = min(last, max(tick, first))
        window = self.outlet.stand(self.mover.s, first, last - first + 1, self._told, self._now)
        if window is None:
            return self._let_down(ticks)
        last = first + len(window) - 1
        self.trace.tick = last
        self.world.advance(last)
        self.execution.end_pulses()
        self._settle()
        return window

    def _settle(self) -> None:
        """At rest: everything that takes no time, until something must be waited for."""
        try:
            while not self._goes_on():
                pass
        except MotionError as error:
            self.fail(error)

    def _goes_on(self) -> bool:
        """As far as it can; False if an error came that the program handles, from now on."""
        try:
            self._go_on()
        except MotionError as error:
            if not self._handle(error):
                raise
            return False
        return True

    @property
    def _held(self) -> bool:
        return self._hold is Hold.HALT or self._paused

    def _go_on(self) -> None:
        """At rest: do what comes next, one thing after the other, up to what `state` then says."""
        while not self.over:
            if self.execution.dwell_until is not None and self.execution.dwell_until <= self.tick:
                self.execution.dwell_until = None
            keeps = self.belt_keeps()
            if self._kept_from_it(keeps):
                return
            if self._begin_interrupt():
                continue
            if self.execution.ended:  # and back where it ended, after a step back
                if self._interrupted is None:
                    self.state = State.FINISHED
                    return
                self._end_interrupt()
                continue
            entry = None if keeps or self.execution.dwell_until is not None else self.execution.front
            if entry is not None and self.leaves_belt(entry.call):
                continue
            if entry is not None and self.breaks.halts(entry, self.line):
                self.state, self._hold = State.HALTED, Hold.HALT
                return
            if not (entry is not None and self._happened(entry)) and self._rests(entry, keeps):
                return

    def _kept_from_it(self, keeps: bool) -> bool:
        """Whether it is not for the program to say what comes next; a belt `keeps` the robot or does not."""
        if self.guard.alarm is not None:
            if self.outlet.feed.failure is None and not (keeps and self._hold is not Hold.NONE):
                raise self.guard.alarm
            self.state = State.COUPLING  # a belt carries the robot: it comes to rest first
            return True
        self._watch()
        if self._hold in (Hold.STOP, Hold.EMERGENCY):
            at_rest = State.STOPPED if self._hold is Hold.STOP else State.EMERGENCY
            self.state = State.COUPLING if keeps else at_rest
            return True
        return self._astray()

    def _happened(self, entry: Entry) -> bool:
        """Do what happens of an entry where the path is; False if nothing does."""
        if self._search_is_over(entry):
            self._cut_off(entry)
        elif (action := self._passing.standing_at(entry)) is not None:
            self.execution.act(action)
        elif self._reached(entry):
            self.execution.blocks.set_out(entry.number)  # where the motion has no length
            self._execute(entry)
        else:
            return False
        return True

    def _rests(self, entry: Entry | None, keeps: bool) -> bool:
        """Look further ahead, or set out to an entry, or wait; False if there may be more to do at once."""
        if self._interpret() or self.planner.plan(self.mover.wanted):
            return False
        if self.execution.dwell_until is not None:
            self.state = State.DWELLING
        elif keeps:
            self.state = State.COUPLING
        elif self._held:
            self.state = State.HALTED
        elif entry is not None and isinstance(entry.call, Barrier):
            self._poll(entry.call)
        elif entry is not None and isinstance(entry.call, End):  # its pulses are waited for
            self.state = State.DWELLING
        elif entry is not None and self._set_out(entry):
            self.state = State.MOVING
        elif self._at_gate:
            self.state = State.WAITING
        elif self.planner.undecided:
            if not (self.dialogue.lacks_room and self._buffer.widen()):
                self.planner.stop()
            return False
        else:
            self._wait()
        return True

    def _astray(self) -> bool:
        """Off the frontier of the program, or on the way back from it: True if the path is dealt with."""
        if self.execution.dwell_until is not None or not (self._backward or self.mover.s < self._frontier):
            return False
        if self.breaks.retraced(self.mover.s):
            self._backward, self._hold = False, Hold.HALT
        if self._held:
            self.state = State.HALTED
        elif self._backward:
            back = self.mover.start_back(self.tick, self.line)
            self.state = State.MOVING if back else State.HALTED
        else:
            self.mover.start(self.tick, self.line)
            self.state = State.MOVING
        return True

    def _search_is_over(self, entry: Entry) -> bool:
        """At rest: whether the motion of `entry` is a search that has found, before its end."""
        if self._held or self._reached(entry):
            return False
        return self._searching.has_found(entry) or self._searching.look(entry, self.tick)

    def _cut_off(self, entry: Entry) -> None:
        """The motion of `entry` ends where the robot stands."""
        self.execution.on_path.drop()
        self.execution.blocks.set_out(entry.number)
        self._last_s = self._frontier = self.mover.s = self.planner.end_here(entry.number, self.mover.s)
        self.outlet.feed.change_path(self.planner.route, self.mover.s)
        self._execute(entry)

    def _reached(self, entry: Entry) -> bool:
        if isinstance(entry.call, Barrier):
            return not self.dialogue.polls(entry.call)
        if isinstance(entry.call, End):
            return self.execution.pulses.next_end is None or self._interrupted is not None
        if not isinstance(entry.call, Motion):
            return True
        place = self.planner.route.place(entry.number)
        return place is not None and place <= self.mover.s + ARRIVED

    def _set_out(self, entry: Entry) -> bool:
        """From rest into the motion of `entry`; False if its path is not known yet."""
        call = entry.call
        assert isinstance(call, Motion), "all other entries are executed at once"
        if not self.mover.start(self.tick, call.line):
            return False
        self.execution.tool = call.tool
        self.execution.blocks.set_out(entry.number)
        self.look_out(setting_out=True)
        return True

    def _poll(self, barrier: Barrier) -> None:
        """The program came back to a barrier in the tick in which it was answered: it polls, once a tick."""
        self.state = State.POLLING
        if self.execution.pulses.next_end is None and not self._may_be_interrupted:
            self._raise(self.dialogue.vain_poll(barrier, self.statements))

    def _wait(self) -> None:
        """Nothing can go on by itself."""
        self.state = State.WAITING
        goes_on = self.execution.pulses.next_end is not None or self._may_be_interrupted
        self._raise(self.planner.failure or (None if goes_on else self.dialogue.vain_wait()))

    @staticmethod
    def _raise(error: MotionError | None) -> None:
        if error is not None:
            raise error

    def _interpret(self) -> bool:
        """Let the interpreter run if it may; True if it did."""
        outcome = self.dialogue.run()
        if isinstance(outcome, Failed):
            self.planner.abort(ExecutionError(outcome.code, outcome.message, outcome.line))
        return outcome is not False

    def _execute(self, entry: Entry) -> None:
        self._searching.end(entry)
        self.execution.execute(entry, self.dialogue)
        if self.execution.ended and self._interrupted is None:
            self.state = State.FINISHED

    def fail(self, failure: MotionError | None) -> None:
        """End the run with what went wrong, if anything did; the robot stands."""
        if failure is not None:
            self.failure = failure
            self.state = State.FAILED
            self.trace.emit("error", failure.line, code=failure.code, message=failure.message)

    # --- records ------------------------------------------------------------------------------------

    @property
    def _now(self) -> Present:
        override = 0.0 if self._paused else self.mover.override * self.mover.direction
        return Present(self.tool, self.line, override, self._hold)

    @property
    def _told(self) -> Told:
        """What is told of the present tick."""
        return Told(self.line, self.dialogue.line, self._buffer.fill)

    def _travelled_mm(self) -> float:
        return self.execution.travelled_mm
