"""Variables shared with the application: when they are read, when what is written is seen."""

from __future__ import annotations

import numpy as np
import pytest
from everywhere import CELL, finished, place, stands

from session_runs import Run, run
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.session import CompileError, Session, compile_text

SHARED = CELL + "[variables]\ncount = 0\nlimit = 2.5\nready = false\n"
ROUND = "MJ P1 F90\nML P2 F300 R20\n"


@pytest.fixture(name="shared", scope="module")
def fixture_shared() -> Cell:
    return parse_cell(SHARED)


def _set(seconds: float, **values: float | str) -> str:
    given = ", ".join(f'"${name}" = {value}' for name, value in values.items())
    return f"[[at]]\nt_s = {seconds!r}\nset = {{ {given} }}\n"


def _written(done: Run, name: str) -> list[tuple[int, float]]:
    return [(e.tick, e.data["value"]) for e in done.events("output") if e.data["signal"] == f"${name}"]


def test_reading_a_variable_stops_the_path_and_takes_the_value_of_the_arrival(shared: Cell) -> None:
    text = f"{ROUND}ML P3 R15\nIF $count >= 3\nML P4\nELSE\nML P1\nENDIF\n"
    for done in finished(text, shared, scenario=_set(0.1, count=3)):
        (read,) = done.events("input_read")
        assert read.tick == done.end_of(3)
        assert stands(done, read.tick)
        assert (read.data["signal"], read.data["value"], read.data["ahead"]) == ("$count", 3.0, False)
        assert done.events("block", 5)


def test_a_variable_can_be_read_ahead(shared: Cell) -> None:
    text = f"{ROUND}ML P3 R15\nIF AHEAD $ready\nML P4\nELSE\nML P1\nENDIF\n"
    for done in finished(text, shared, scenario=_set(0.1, ready="true")):
        (read,) = done.events("input_read")
        assert (read.tick, read.data["value"], read.data["ahead"]) == (0, False, True)
        assert done.reasons[3] == "ROUNDED"
        assert done.events("block", 7)


def test_writing_neither_stops_the_path_nor_changes_it(shared: Cell) -> None:
    plain = {done.session.kernel.mover.override: done for done in finished(f"{ROUND}ML P3\n", shared)}
    for done in finished(f"{ROUND}INC $count\nLET $ready = TRUE\nML P3\n", shared):
        same = plain[done.session.kernel.mover.override]
        assert np.array_equal(done.joints, same.joints)
        ((tick, value),) = _written(done, "count")
        assert value == 1.0
        assert _written(done, "ready") == [(tick, True)]
        assert 0 < tick < len(done.joints) - 1
        assert not stands(done, tick), "it happens in the round edge"


def test_what_is_written_is_seen_in_the_next_tick(shared: Cell) -> None:
    text = "LET $count = 5\nIF $count = 5\nSET DO1\nENDIF\nL: IF $count < 5\nGOTO L\nENDIF\nSET DO2\n"
    for done in finished(text, shared):
        assert [e.data["value"] for e in done.events("input_read")] == [0.0, 0.0, 5.0]
        (output,) = [e for e in done.events("output") if e.data["signal"].startswith("DO")]
        assert (output.tick, output.data["signal"]) == (1, "DO2")


def test_increments_of_one_tick_add_up(shared: Cell) -> None:
    text = "INC $count\nINC $count 2.5\nLET $limit = 10\nINC $limit -4\nWAIT 0.01\nINC $count $limit\n"
    for done in finished(text, shared):
        assert [value for _, value in _written(done, "count")] == [1.0, 3.5, 9.5]
        assert [value for _, value in _written(done, "limit")] == [10.0, 6.0]
        assert done.session.variable("count") == 3.5, "the last one is seen one tick later"


def test_values_are_read_where_the_path_has_arrived(shared: Cell) -> None:
    text = f"{ROUND}LET $limit = $count\nLET $ready = $count > 2 AND NOT DI1\nML P3\n"
    for done in finished(text, shared, scenario=_set(0.1, count=3)):
        assert _written(done, "limit") == [(done.end_of(2), 3.0)]
        assert _written(done, "ready") == [(done.end_of(2), True)]
        assert stands(done, done.end_of(2))


def test_a_variable_is_written_at_a_place_of_a_motion(shared: Cell) -> None:
    text = "MJ P1 F90\nAT 50% INC $count 2\nAT D-0 LET $ready = TRUE\nML P2 F200\n"
    for done in finished(text, shared):
        ((tick, value),) = _written(done, "count")
        assert value == 2.0
        assert abs(done.column("position")[tick][1]) < 3e-4, "half way between y = -50 and 50"
        assert _written(done, "ready") == [(done.end_of(4), True)]


def test_a_wait_and_a_search_end_when_a_variable_says_so(shared: Cell) -> None:
    text = "WAIT $count >= 2\nML P1 F100\nML P2 F100 UNTIL $ready\nIF FOUND\nSET DO1\nENDIF\n"
    scenario = _set(0.25, count=2) + _set(1.0, ready="true")
    for done in finished(text, shared, scenario=scenario):
        assert done.events("wait", 1)[0].data["t_end"] == pytest.approx(0.25)
        (found,) = done.events("search")
        assert found.data["found"] is True
        assert done.events("output")


def test_the_scenario_answers_variables(shared: Cell) -> None:
    scenario = (
        '[[when]]\nsignal = "$count"\nbecomes = 2\nafter_s = 0.3\nset = { "$ready" = true, DI1 = true }\n'
        '[[when]]\nsignal = "$ready"\nafter_s = 0.2\nset = { "$limit" = 7 }\n'
    )
    text = "INC $count\nWAIT 0.1\nINC $count\nWAIT $ready\nWAIT DI1\nWAIT $limit > 3\nWAIT $count = 9\n"
    done = run(text, shared, scenario=scenario)
    waits = [e.data["t_end"] for e in done.events("wait")]
    assert waits[1:] == pytest.approx([0.4, 0.6])
    assert (done.code, done.failed_line) == ("E410", 7)


def test_an_application_reads_and_writes_variables_while_a_program_runs() -> None:
    cell = parse_cell(SHARED)
    loaded = compile_text("L: IF NOT $Ready\nINC $count\nWAIT 0.01\nGOTO L\nENDIF\n", cell=cell)
    session = Session(cell, loaded, window=10, patient=True)
    for window in session.run():
        if window.first_tick > 50 and not session.variable("ready"):
            seen = session.variable("count")
            session.set_variable("READY", True)
    assert session.status.value == "finished"
    assert seen == 6.0
    assert session.variable("COUNT") == 6.0
    with pytest.raises(KeyError):
        session.variable("cuont")
    with pytest.raises(ValueError, match="takes a finite number"):
        session.set_variable("count", True)
    with pytest.raises(ValueError, match="takes a finite number"):
        session.set_variable("count", float("nan"))
    with pytest.raises(ValueError, match="takes true or false"):
        session.set_variable("ready", 1.0)


def test_a_forced_variable_keeps_its_value_until_it_is_let_go(shared: Cell) -> None:
    loaded = compile_text("INC $count\nWAIT 0.02\nINC $count\nWAIT 0.02\n", cell=shared)
    session = Session(shared, loaded, window=10)
    session.force("$count", 7.0)
    for window in session.run():
        if window.first_tick < 30:
            assert session.variable("count") == 7.0
        else:
            session.release("$count")
    assert session.variable("count") == 2.0


def test_a_program_of_another_cell_is_told_what_is_missing(shared: Cell) -> None:
    read, write = (compile_text(t, cell=shared) for t in ("IF $count > 1\nENDIF\n", "INC $count\n"))
    bare, other = place(), parse_cell(SHARED.replace("count = 0", "count = false"))
    codes = []
    for cell in (bare, other):
        for loaded in (read, write):
            session = Session(cell, loaded)
            session.finish()
            assert session.failure is not None
            assert "$count" in session.failure.message
            codes.append(session.failure.code)
    assert codes == ["E411", "E314"] * 2


def test_what_was_written_is_not_written_again_from_a_line(shared: Cell) -> None:
    text = "ML P1 F100\nINC $count\nLET $ready = TRUE\nML P2\nINC $count 2\n"
    session = session_of_shared(text, shared, first_line=4)
    session.finish()
    assert session.status.value == "finished"
    values = [e.data["value"] for e in session.events if e.kind == "output"]
    assert values == [2.0]


def session_of_shared(text: str, cell: Cell, **options: int) -> Session:
    return Session(cell, compile_text(text, cell=cell), **options)


def test_without_a_cell_nobody_knows_a_variable() -> None:
    with pytest.raises(CompileError) as error:
        compile_text("INC $count\n")
    assert [d.code for d in error.value.diagnostics] == ["E212"]
