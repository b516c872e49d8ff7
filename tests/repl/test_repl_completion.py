"""What the Tab key offers."""

from __future__ import annotations

import pytest
from repl_sittings import Sitting

from viapoint.repl.completion import complete

CASES = [
    ("M", ["ML", "MJ", "MC", "MS", "M"][:4]),
    ("SE", ["SET"]),
    ("ML cor", ["corner"]),
    ("SET A", ["AO1", "AO2", "AO3", "AO4", "AO5", "AO6", "AO7", "AO8"]),
    ("AT D20 ", ["SET", "RESET", "PULSE", "M", "LET", "INC"]),
    ("LET ", ["$count", "$ready"]),
    ("AT D20 INC $c", ["$count"]),
    (":io $", ["$count", "$ready"]),
    ("AT D20 PULSE gri", ["gripper"]),
    ("WAIT DI3 T", ["TIMEOUT"]),
    ("WAIT DI3 TIMEOUT 2 GOTO D", ["DROP"]),
    ("IF AH", ["AHEAD"]),
    ("IF le", ["level"]),
    ("RESET DO1 x", []),
    ("ml P", ["P1", "P2", "P3", "P4", "P6"]),
    ("ML P1 T", ["T0", "T1"]),
    ("ML P1 Z", ["Z0", "Z1"]),
    ("ML X", ["X="]),
    ("ML X=100 X", []),
    ("ML X=100 P", []),
    ("MJ J1=10 J", ["J1=", "J2=", "J3=", "J4=", "J5=", "J6="]),
    ("ML P1 F100 F", []),
    ("T ", ["0", "1"]),
    ("SUB ", ["LOOP", "DROP"]),
    ("A: GOTO D", ["DROP"]),
    ("OFF ", ["LOOP", "DROP"]),
    ("ON part", ["part_present"]),
    ("ON E", ["ERROR"]),
    ("ON DI3 S", ["SUB"]),
    ("ON DI3 AN", ["AND"]),
    ("ON DI3 SUB D", ["DROP"]),
    ("ON ERROR S", ["SUB"]),
    ("ON ERROR A", []),
    ("ON ERROR SUB D", ["DROP"]),
    ("RESUME N", ["NEXT"]),
    ("RETR", ["RETRY"]),
    ("IF part", ["part_present"]),
    ("IF DI3 AN", ["AND"]),
    ("SET g", ["gripper"]),
    (":lo", [":load"]),
    (":st", [":step", ":stop", ":status"]),
    (":load pa", ["part.via"]),
    (":load ../files/pa", ["../files/part.via"]),
    (":break D", ["DROP"]),
    (":io le", ["level"]),
    (":teach P6", []),
    (":help re", ["reset", "reference", "record"]),
    (":frob x", []),
]


@pytest.mark.parametrize(("text", "words"), CASES)
def test_words(text: str, words: list[str], sitting: Sitting) -> None:
    sitting.enter(":load part.via")
    found, length = complete(sitting.console, text)
    assert [word for word in found if not word.isdecimal() or "T" in text] == words
    assert text[len(text) - length :].strip() == text[len(text) - length :]


def test_every_word_offered_is_taken(sitting: Sitting) -> None:
    """What completion offers for a motion is what the language takes there."""
    sitting.enter("MJ P1 F60")
    for word in complete(sitting.console, "ML P2 ")[0]:
        value = "" if any(character.isdecimal() for character in word) else "5"
        said = sitting.enter(f"ML P2 {word}{value}")
        assert "error[E1" not in said, (word, said)


def test_subroutines_typed_are_offered(sitting: Sitting) -> None:
    sitting.enter("GRIP:", "SET DO1", "END")
    assert complete(sitting.console, "SUB G")[0] == ["GRIP"]
