"""Scenario files: what they give, and everything that can be wrong with one, all at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from viapoint.language.catalogue import CATALOGUE
from viapoint.runtime.cell import Cell, default_cell, parse_cell
from viapoint.runtime.signals import ScenarioError, SignalWorld, load_scenario, parse_scenario

TEXT = """\
seed = 1
[[at]]
t_s = 2.0
set = { DI3 = true }
[[when]]
signal = "DO1"
becomes = true
after_s = 0.3
set = { DI2 = true }
[[when]]
m = 5
robots = [1, 2]
after_s = 0.5
reset_m = 5
[[conveyor]]
index = 1
speed_mm_s = [[0.0, 0.0], [1.0, 200.0]]
noise_counts = 0.5
[[correction]]
frame = "tool"
z_mm = [[0.0, 0.0], [1.0, 2.0]]
max_rate_mm_s = 20
"""


@pytest.fixture(name="cell", scope="module")
def fixture_cell() -> Cell:
    return default_cell()


def codes(text: str, cell: Cell) -> list[tuple[str, int | None, str | None]]:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, cell)
    return [(each.code, each.line, each.key) for each in caught.value.diagnostics]


def test_every_key_is_taken(cell: Cell) -> None:
    scenario = parse_scenario(TEXT, cell)
    assert scenario.seed == 1
    assert scenario.timed[0].time == 2.0
    assert [answer.delay for answer in scenario.answers] == [0.3, 0.5]
    assert scenario.answers[1].robots == (1, 2)
    assert scenario.belts[0].speeds.tolist() == [0.0, pytest.approx(0.2)]
    assert scenario.corrections[0].axes[2] is not None
    assert scenario.corrections[0].axes[0] is None
    assert scenario.source.text == TEXT


def test_empty_scenario_is_good(cell: Cell) -> None:
    assert not SignalWorld(cell, parse_scenario("", cell), cell.tick).pending()


def test_all_faults_at_once_each_at_its_line(cell: Cell) -> None:
    text = """\
sed = 3
[[at]]
t_s = 1
set = { DI99 = true, DI1 = 1, AI1 = nan, DO1 = true }
[[at]]
t_s = inf
[[when]]
after_s = 1
[[when]]
signal = "AI1"
m = 5
reset_m = 5
[[conveyor]]
index = 4
speed_mm_s = [[1, 0], [1, 2]]
"""
    assert codes(text, cell) == [
        ("E292", 1, "sed"),
        ("E293", 5, "at[1].set"),
        ("E295", 6, "at[1].t_s"),
        ("E293", 7, "when[0].signal"),
        ("E293", 7, "when[0].set"),
        ("E299", 11, "when[1].m"),
        ("E298", 14, "conveyor[0].index"),
        ("E299", 15, "conveyor[0].speed_mm_s"),
    ]


def test_a_faulty_key_is_not_missing_too(cell: Cell) -> None:
    assert codes('[[when]]\nsignal = "DO1"\nset = 3\n', cell) == [("E294", 3, "when[0].set")]


def test_faults_of_signals(cell: Cell) -> None:
    text = "[[at]]\nt_s = 1\nset = { DI99 = true, DI1 = 1, AI1 = nan, DO1 = true }\n"
    assert [code for code, _, _ in codes(text, cell)] == ["E294", "E295", "E298", "E299"]


def test_variables_are_set_and_answered_by_their_kind(cell: Cell) -> None:
    shared = parse_cell('[robot]\nmodel = "frigeni6"\n[variables]\ncount = 0\nready = false\n')
    good = (
        '[[at]]\nt_s = 1\nset = { "$COUNT" = 3, "$ready" = true }\n'
        '[[when]]\nsignal = "$count"\nbecomes = 3\nset = { "$ready" = false }\n'
        '[[when]]\nsignal = "$ready"\nset = { "$count" = 1.5 }\n'
    )
    scenario = parse_scenario(good, shared)
    assert [(str(c.target), c.value) for c in scenario.timed[0].changes] == [
        ("$count", 3.0),
        ("$ready", True),
    ]
    assert [(str(a.cause.target), a.cause.value) for a in scenario.answers] == [
        ("$count", 3.0),
        ("$ready", True),
    ]
    bad = (
        '[[at]]\nt_s = 1\nset = { "$count" = true, "$ready" = 1, "$cuont" = 3 }\n'
        '[[when]]\nsignal = "$count"\nset = { DI1 = true }\n'
        '[[when]]\nsignal = "$ready"\nbecomes = 1\nset = { DI1 = true }\n'
        '[[when]]\nsignal = "DO1"\nbecomes = 1.5\nset = { DI1 = true }\n'
    )
    assert [code for code, _, _ in codes(bad, shared)] == ["E294", "E294", "E298", "E293", "E294", "E294"]
    with pytest.raises(ScenarioError) as caught:
        parse_scenario('[[at]]\nt_s = 1\nset = { "$cuont" = 3 }\n', shared)
    assert [each.hint for each in caught.value.diagnostics] == ["did you mean `$count`?"]


def test_unreadable_files(cell: Cell, tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    for name in ("none.toml", "bad.toml"):
        with pytest.raises(ScenarioError) as caught:
            load_scenario(tmp_path / name, cell)
        assert [each.code for each in caught.value.diagnostics] == ["E290"]


def test_faults_stand_in_the_catalogue(cell: Cell, tmp_path: Path) -> None:
    found = []
    for code, entry in CATALOGUE.items():
        if code.startswith("E29"):
            found.append(code)
            for example in entry.examples:
                path = tmp_path / f"{code}.toml"
                path.write_bytes((example.scenario or "").encode() if example.data is None else example.data)
                with pytest.raises(ScenarioError) as caught:
                    load_scenario(path, cell)
                assert code in [each.code for each in caught.value.diagnostics]
    assert found == [f"E29{n}" for n in range(10)]
