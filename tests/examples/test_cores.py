"""Whole runs by the numpy twins and by the compiled modules: the same events in the same ticks."""

from __future__ import annotations

import numpy as np
import pytest
from example_runs import EXAMPLES, MANIFEST, Example, Run, run_program

from viapoint.runtime import core

SAME_SET_POINT = 1e-9
LONGEST = 30.0
"""s of each example that is compared."""


@pytest.mark.parametrize("example", MANIFEST, ids=lambda example: example.name)
def test_twin_and_compiled_modules_run_alike(example: Example, monkeypatch: pytest.MonkeyPatch) -> None:
    built = core.built("timing._core") is not None

    def by(name: str) -> Run:
        monkeypatch.setattr(core, "asked", name)
        return run_program(EXAMPLES / example.program, example, max_time=LONGEST)

    twin, compiled = by("python"), by("compiled" if built else "auto")
    assert len(twin.events) > 0
    assert [(e.tick, e.line, e.kind) for e in twin.session.events] == [
        (e.tick, e.line, e.kind) for e in compiled.session.events
    ]
    assert np.array_equal(twin.ticks, compiled.ticks)
    assert np.abs(twin.joints - compiled.joints).max() <= SAME_SET_POINT
