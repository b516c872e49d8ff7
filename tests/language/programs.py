"""Random programs: statements made from the command table, and mutations of texts.

Lines come from seeds, so that hypothesis shrinks a failing program to its failing lines and prints the
seeds of those.
"""

from __future__ import annotations

from random import Random

from hypothesis import strategies as st

from viapoint.language.commands import (
    ACTIONS,
    H_TANGENT,
    INDEX,
    MOTIONS,
    NOT_NEGATIVE,
    REAL,
    Domain,
    Form,
    Operand,
)

NAMES = ("LOOP", "a", "Cut_1", "PART12", "T", "x9y")
ODD_NUMBERS = ("0", "-1", "1.5", "70000", "1E3", "2e-2", "+4", "-0", "1E10", "007", ".5", "3.")


def number(random: Random, domain: Domain) -> str:
    """A number of a domain as it is usually written; now and then an unusual one."""
    if random.random() < 0.1:
        return random.choice(ODD_NUMBERS)
    if domain.is_whole:
        return str(random.randint(int(domain.low), int(min(domain.high, 65_000))))
    low = 0.001 if domain.low > 0 else max(domain.low, -5000.0)
    return f"{random.uniform(low, 5000.0):.{random.randint(0, 4)}f}"


def motion(random: Random) -> str:
    """A motion with some of its parameters in any order, mostly a right one."""
    command = random.choice(MOTIONS)
    chosen = random.sample(command.parameters, random.randint(0, min(5, len(command.parameters))))
    words = []
    for parameter in chosen:
        axis = str(random.randint(1, 9)) if parameter.form is Form.NUMBERED else ""
        sign = "" if parameter.form is Form.GLUED else "="
        words.append(parameter.code + axis + sign + number(random, parameter.domain))
    codes = {parameter.code for parameter in chosen}
    if command.needs and not codes & {"P", "X", "Y", "A"}:
        words.insert(0, random.choice((f"P{random.randint(0, 500)}", "pick", "P(place)")))
    if command.word == "MC" and not any(code.startswith("Q") for code in codes):
        words.append(f"Q{random.randint(0, 500)}")
    return random.choice((" ", " ", "  ", "\t")).join([command.word, *words])


def condition(random: Random) -> str:
    """A chain of signals, sometimes mixed, sometimes with parentheses and comparisons."""
    words = []
    for _ in range(random.randint(1, 4)):
        signal = f"{random.choice(('DI', 'DO', 'M'))}{random.choice(('', ' '))}{random.randint(0, 40)}"
        forms = (
            signal,
            signal,
            f"NOT {signal}",
            f"({signal})",
            "1 < 2",
            "AI1 > 2.5",
            "$n >= AI2",
            "$r",
            "TRUE",
            "ready",
        )
        words += [random.choice(forms), random.choice(("AND", "AND", "OR"))]
    return " ".join(words[:-1])


def output(random: Random, operand: Operand) -> str:
    """An output by its number or name, with what its command wants of it."""
    which = random.choice((f"DO{random.choice(('', ' '))}{number(random, INDEX)}", "gripper", "AO 1", "DI1"))
    if operand is Operand.PULSE:
        return f"{which} {number(random, NOT_NEGATIVE)}"
    return f"{which}{random.choice(('', '', '=2.5', ' = -1', ' 3'))}"


def action(random: Random) -> str:
    """An auxiliary statement with its operand, glued or spaced."""
    command = random.choice(ACTIONS)
    word, domain = command.word, command.domain
    match command.operand:
        case Operand.NOTHING:
            return word
        case Operand.CONDITION:
            word = "ELSE IF" if word == "ELSEIF" and random.random() < 0.5 else word
            return f"{word}{random.choice(('', '', ' AHEAD', ' ahead'))} {condition(random)}"
        case Operand.LABEL_TIMES:
            assert domain is not None
            return f"{word} {random.choice(NAMES)}{random.choice(('', ' ' + number(random, domain)))}"
        case Operand.TANGENT:
            return f"{word} {random.choice(('0', '1', '1 H' + number(random, H_TANGENT.domain), '2'))}"
        case Operand.WAIT:
            limit = random.choice(("", "", " TIMEOUT 2.5", " TIMEOUT 1 GOTO LOOP", " timeout -1"))
            waited = random.choice(
                (f"{condition(random)}{limit}", number(random, NOT_NEGATIVE), f"DI {number(random, INDEX)}")
            )
            return f"{word} {waited}"
        case Operand.OUTPUT | Operand.LEVEL | Operand.PULSE:
            return f"{word} {output(random, command.operand)}"
        case Operand.LET:
            return f"{word} $n {random.choice(('=', '=', '= ', ''))}{assigned(random)}"
        case Operand.INC:
            return f"{word} {random.choice(('$n', '$n', '$', 'n'))} {random.choice(('', assigned(random)))}"
        case Operand.PLACE:
            place = random.choice(("D20", "D-20.5", "d-0", "S-.5", "S3", "50%", "(2*3) %", "150%", "D", "20"))
            action = random.choice(
                (
                    "SET DO1",
                    "RESET clamp",
                    "PULSE DO2 0.5",
                    "M5",
                    "SET AO1=2",
                    "INC $n 2",
                    "LET $n=3",
                    "M",
                    "ML P1",
                )
            )
            return f"{word} {place} {action}"
        case Operand.INTERRUPT:
            behind = random.choice(
                (f" SUB {random.choice(NAMES)}", " sub LOOP", "", " GOTO LOOP", " SUB a 2")
            )
            what = random.choice(("ERROR", condition(random), condition(random), "ERRNO = 302"))
            return f"{word} {what}{behind}"
        case Operand.NEXT:
            return f"{word} {random.choice(('NEXT', 'next', '', 'NEXT 3'))}"
        case Operand.LABEL:
            return f"{word} {random.choice((*NAMES, '3', ''))}"
        case Operand.VALUE:
            assert domain is not None
            return f"{word}{random.choice(('', ' '))}{number(random, domain)}"


def assigned(random: Random) -> str:
    """A value for a variable."""
    return random.choice((number(random, REAL), "TRUE", "$other", "AI1", "(2*3)", condition(random)))


def line(random: Random) -> str:
    """A line: indentation, label, statement, comment; any of them may be missing."""
    statement = random.choice((motion, motion, action, lambda _: ""))(random)
    statement = statement.lower() if random.random() < 0.1 else statement
    label = random.choice(("", "", "", f"{random.choice(NAMES)}:", f"{random.choice(NAMES)}: "))
    comment = random.choice(("", "", "", "// note 5", " //#2 x=1"))
    return random.choice(("", "", "  ", "\t")) + label + statement + random.choice(("", " ")) + comment


SEEDS = st.integers(0, 2**32 - 1)
MOTIONS_OF_SEEDS = SEEDS.map(lambda seed: motion(Random(seed)))
PROGRAMS = st.lists(SEEDS, max_size=12).map(lambda seeds: "\n".join(line(Random(seed)) for seed in seeds))

_PIECES = (
    *("(", ")", "=", "==", "-", "+", ".", ",", "//", '"', "\\", " ", "\t", "\n", "\r\n", "\r", ":", "$", "#"),
    *(
        "\0",
        "\x01",
        "\ufeff",
        "ü",
        "😀",
        "1",
        "9" * 30,
        "E",
        "1E1",
        "ML",
        "P",
        "IF ",
        "NOT",
        "AND",
        "DI",
        "LET ",
    ),
    *(
        "X=",
        "J1=",
        "GOTO ",
        "SUB ",
        "ELSE",
        "SET DO",
        "WAIT ",
        "TANG 1 H",
        "((((",
        "*",
        "/",
        "MOD",
        "<",
        "<>",
    ),
)


def mutated(text: str, seed: int) -> str:
    """`text` with a few random edits."""
    random = Random(seed)
    for _ in range(random.randint(1, 6)):
        start = random.randint(0, len(text))
        end = min(len(text), start + random.choice((0, 0, 1, 2, 8)))
        text = text[:start] + random.choice(_PIECES) + text[end:]
    return text
