"""Scenarios 7, 8 and 9: counts and subroutines while the interpreter runs ahead."""

from __future__ import annotations

from everywhere import finished

from session_runs import Run, at


def motions(done: Run) -> list[int]:
    return [e.line for e in sorted(done.events("block"), key=lambda e: e.tick)]


def test_7_counted_goto_nested_in_a_counted_goto() -> None:
    text = (
        "OUTER:\nMJ J1=-1.2 F90\nINNER:\nMJ J1=-1.4 R0.1\nMJ J1=-1\nGOTO INNER 3\nMJ J1=-0.8\nGOTO OUTER 2\n"
    )
    for done in finished(text):
        assert motions(done) == [2, 4, 5, 4, 5, 4, 5, 7] * 2


def test_8_counted_loop_left_by_another_goto_entered_again() -> None:
    """The count starts afresh: after the jump out and back the body runs three times again."""
    text = (
        "MJ J1=2 F90\nBODY:\nMJ J1=-1\nIF DI1\nGOTO OUT\nENDIF\nMJ J1=-1.5\nGOTO BODY 3\nSET DO1\nEND\n"
        "OUT:\nMJ J1=-2\nWAIT NOT DI1\nGOTO BODY\n"
    )
    for override_run in finished(text, scenario=at(0.5, DI1=True) + at(2.5, DI1=False)):
        seen = motions(override_run)
        out = seen.index(12)
        assert seen[:out].count(3) == seen[:out].count(7) + 1
        assert seen[out + 1 :] == [3, 7, 3, 7, 3, 7]
        assert len(override_run.events("output")) == 1


def test_9_nested_sub_with_a_counted_goto_inside_round_edges_across_call_and_return() -> None:
    text = (
        "MJ P1 F90\nML P2 F300 R20\nSUB A 2\nML P1 R15\nML P2\nEND\n"
        "A:\nML P3 R20\nSUB B\nML X=1550 Y=0 R10\nEND\n"
        "B:\nROW:\nML P4 R15\nML P1 R15\nML P2 R15\nGOTO ROW 2\nEND\n"
    )
    for done in finished(text):
        inner = [14, 15, 16, 14, 15, 16]
        assert motions(done) == [1, 2, 8, *inner, 10, 8, *inner, 10, 4, 5]
        corners = {(each.line, each.next_line): each.transition.reason.name for each in done.session.corners}
        across = [(2, 8), (8, 14), (16, 14), (16, 10), (10, 8), (10, 4)]
        assert [corners[pair] for pair in across] == ["ROUNDED"] * len(across)
