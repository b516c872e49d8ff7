"""Random programs: compiled, written, read and run, they are the same program."""

from __future__ import annotations

import random

import pytest

from viapoint.compiler import compile_source
from viapoint.language.source import Source
from viapoint.vm import ScriptedWorld, disassemble, load, run_canonical, save
from viapoint.vm.instructions import decode_all, encode
from viapoint.vm.verifier import verify


class _Writer:
    """Writes a random program that compiles: blocks closed, labels known, counts small."""

    def __init__(self, seed: int) -> None:
        self._rng = random.Random(seed)
        self._lines: list[str] = []
        self._labels = 0

    def program(self) -> str:
        self._block(2)
        self._lines.append("END")
        for number in range(3):
            self._lines.append(f"S{number}_:")
            self._block(1)
            self._lines.append("END")
        return "".join(f"{line}\n" for line in self._lines)

    def _block(self, depth: int) -> None:
        for _ in range(self._rng.randrange(1, 6)):
            match self._rng.randrange(8):
                case 0 if depth:
                    self._branches(depth - 1)
                case 1 if depth:
                    self._loop(depth - 1)
                case 2 if depth == 2:
                    self._lines.append(f"SUB S{self._rng.randrange(3)}_ {self._rng.randrange(1, 4)}")
                case 3:
                    self._lines.append(self._action())
                case _:
                    self._lines.append(self._motion())

    def _branches(self, depth: int) -> None:
        self._lines.append(f"IF {self._condition(2)}")
        self._block(depth)
        for _ in range(self._rng.randrange(2)):
            self._lines.append(f"ELSEIF {self._condition(2)}")
            self._block(depth)
        if self._rng.random() < 0.5:
            self._lines.append("ELSE")
            self._block(depth)
        self._lines.append("ENDIF")

    def _loop(self, depth: int) -> None:
        self._labels += 1
        label = f"L{self._labels}_"
        self._lines.append(f"{label}:")
        self._block(depth)
        self._lines.append(f"GOTO {label} {self._rng.randrange(1, 4)}")

    def _condition(self, depth: int) -> str:
        rng = self._rng
        if depth == 0 or rng.random() < 0.3:
            signal = f"{rng.choice(('DI', 'DO', 'M'))}{rng.randrange(1, 4)}"
            return rng.choice((signal, f"{rng.randrange(3)} {rng.choice(('<', '>=', '<>'))} 1"))
        left, right = self._condition(depth - 1), self._condition(depth - 1)
        return rng.choice((f"({left} AND {right})", f"({left} OR {right})", f"NOT ({left})"))

    def _action(self) -> str:
        n = self._rng.randrange(1, 4)
        choices = (f"SET DO {n}", f"RESET DO {n}", f"M {n}", f"T {n}", f"WAIT {n / 4}", f"WAIT DI {n}")
        return self._rng.choice(choices)

    def _motion(self) -> str:
        rng = self._rng
        target = rng.choice((f"P{rng.randrange(9)}", f"X={rng.uniform(-9, 9):.3f} C={rng.randrange(99)}"))
        words = [rng.choice(("ML", "MJ", "MS", f"MC Q{rng.randrange(9)}")), target]
        words += rng.sample(
            (f"Z{rng.randrange(3)}", f"T{rng.randrange(3)}", "F100", "E1=5"), rng.randrange(4)
        )
        return " ".join(words)


def _world(seed: int) -> ScriptedWorld:
    rng = random.Random(seed)
    inputs = {index: [*(rng.random() < 0.5 for _ in range(9)), True] for index in (1, 2, 3)}
    return ScriptedWorld(inputs, frozenset({2}))


@pytest.mark.parametrize("seed", range(60))
def test_the_file_runs_as_the_source(seed: int) -> None:
    text = _Writer(seed).program()
    result = compile_source(Source("random.via", text))
    assert result.program is not None, (seed, result.diagnostics)
    program = result.program
    verify(program)
    assert (
        b"".join(encode(one.instruction, *one.operands) for one in decode_all(program.code)) == program.code
    )
    calls = run_canonical(program, _world(seed))
    assert calls[-1].endswith("END"), (seed, text)
    again = load(save(program))
    assert again == program
    assert run_canonical(again, _world(seed)) == calls, (seed, text)
    assert run_canonical(again, _world(seed), refuse_every=2) == calls, (seed, text)
    assert disassemble(again) == disassemble(program)


@pytest.mark.parametrize("seed", range(60, 80))
def test_compiling_depends_on_the_text_alone(seed: int) -> None:
    text = _Writer(seed).program()
    first, second = (compile_source(Source("random.via", text)) for _ in range(2))
    assert first.program == second.program
    assert [(each.code, each.span, each.message) for each in first.diagnostics] == [
        (each.code, each.span, each.message) for each in second.diagnostics
    ]


@pytest.mark.parametrize("seed", range(40))
def test_no_damaged_text_breaks_the_compiler(seed: int) -> None:
    rng = random.Random(seed)
    lines = _Writer(seed).program().splitlines()
    for _ in range(5):
        at = rng.randrange(len(lines))
        match rng.randrange(4):
            case 0:
                del lines[at]
            case 1:
                lines.insert(at, lines[rng.randrange(len(lines))])
            case 2:
                lines[at] = lines[at][: rng.randrange(len(lines[at]) + 1)]
            case _:
                lines[at] = rng.choice(("ELSE", "ENDIF", "IF", "GOTO X9_", "SUB", "L1_:", "ML Q", "\x00"))
        lines.append("END")
    result = compile_source(Source("random.via", "\n".join(lines)))
    if result.program is None:
        assert any(each.is_error for each in result.diagnostics), seed
    else:
        verify(result.program)
        run_canonical(result.program, _world(seed), call_limit=300)
