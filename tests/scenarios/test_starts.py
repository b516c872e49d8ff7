"""Scenario 19: starting from a line inside a subroutine inside a loop."""

from __future__ import annotations

import numpy as np
import pytest
from everywhere import finished, place, session_of

from viapoint.session import compile_text
from viapoint.starting import StartError, start_at

TEXT = (
    "MJ P1 F90\nLOOP:\nML P2 F300 R20\nSUB PART\nML P1\nGOTO LOOP 3\nEND\nPART:\nML P3 R20\nML P4 R15\nEND\n"
)


def test_19_start_from_a_line_inside_a_sub_inside_a_loop_refuses_and_names_the_nearest() -> None:
    where = place()
    program = compile_text(TEXT, cell=where).program
    for line in (9, 10):
        with pytest.raises(StartError) as refused:
            start_at(program, where, line)
        nearest = refused.value.nearest
        assert nearest is not None
        session = session_of(TEXT, first_line=nearest)
        assert session.finish().value == "finished"
    for whole in finished(TEXT):
        assert np.abs(session.kernel.telemetry.joints - whole.joints[-1]).max() < 1e-9
