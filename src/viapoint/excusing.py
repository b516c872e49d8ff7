"""Planning past errors that a program handles: a statement whose error ON ERROR handles is an exact stop."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from viapoint.runtime.kernel.failure import may_be_handled
from viapoint.vm.ports import Barrier, Call, HandleErrors, Handler, SwitchOff

if TYPE_CHECKING:
    from viapoint.runtime.kernel import MotionError
    from viapoint.runtime.kernel.forecast import Forecast


def handling_errors(handler: Handler | None, calls: Iterable[Call]) -> Handler | None:
    """What handles errors behind calls that were made where `handler` did."""
    for call in calls:
        if isinstance(call, HandleErrors):
            handler = call.handler
        elif isinstance(call, SwitchOff) and call.handler == handler:
            handler = None
    return handler


def plan_excused(
    calls: Sequence[Call],
    handler: Handler | None,
    planned: Forecast,
    forecast: Callable[[tuple[Call, ...]], Forecast | None],
) -> tuple[Forecast | None, tuple[Call, ...], tuple[MotionError, ...]]:
    """How calls are planned without the statements whose errors are handled, and those errors.

    `handler` handles errors where they begin; `planned` is how they are with all of them. None where
    `forecast` plans no more.
    """
    left, excused = list(calls), []
    found: Forecast | None = planned
    while found is not None and (k := _handled(handler, left, found)) is not None:
        assert found.failure is not None, "it is handled"
        excused.append(found.failure)
        left[k] = Barrier(line=left[k].line, reason="ON ERROR")
        found = forecast(tuple(left))
    return found, tuple(left), tuple(excused)


def _handled(handler: Handler | None, calls: Sequence[Call], planned: Forecast) -> int | None:
    """Which of the calls has the error of their plan, if the program handles it; None if it does not."""
    error = planned.failure
    if error is None or not may_be_handled(error):
        return None
    done = planned.blocks[-1].number + 1 if planned.blocks else 0
    k = next((k for k in range(done, len(calls)) if calls[k].line == error.line), None)
    return None if k is None or handling_errors(handler, calls[:k]) is None else k
