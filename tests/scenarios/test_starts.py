"""Scenario 19: starting from a line inside a subroutine inside a loop."""

from __future__ import annotations

import numpy as np
import pytest
from everywhere import finished, place

from viapoint.session import compile_text
from viapoint.starting import StartError, start_at

TEXT = (
    "MJ P1 F90\nLOOP:\nML P2 F300 R20\nSUB PART\nML P1\nGOTO LOOP 2\nEND\nPART:\nML P3 R20\nML P4 R15\nEND\n"
)


def test_19_start_from_a_line_inside_a_sub_inside_a_loop_refuses_and_names_the_nearest() -> None:
    where = place()
    program = compile_text(TEXT, cell=where).program
    named = set()
    for line in (9, 10):
        with pytest.raises(StartError) as refused:
            start_at(program, where, line)
        named.add(refused.value.nearest)
    (nearest,) = named
    assert nearest == 6
    for begun, whole in zip(finished(TEXT, first_line=nearest), finished(TEXT), strict=True):
        assert np.abs(begun.joints[-1] - whole.joints[-1]).max() < 1e-9
        lines = [e.line for e in sorted(begun.events("block"), key=lambda e: e.tick)]
        assert lines == [6, 3, 9, 10, 5]  # the way to where line 6 begins, then once more round
