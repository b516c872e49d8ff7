"""Program files and texts to programs that a robot of a cell can run; and what a compiler is told of a cell.

Not here: running them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from viapoint.compiler import CellNames, CompileResult, compile_source
from viapoint.language.diagnostics import Diagnostic, has_errors
from viapoint.language.reading import read_source
from viapoint.language.source import Source
from viapoint.runtime.cell import Cell
from viapoint.vm import Program, ProgramFileError, load


class CompileError(Exception):
    """A program that does not compile; `diagnostics` holds everything that was found."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        errors = [d for d in diagnostics if d.is_error]
        super().__init__("; ".join(f"{d.code}: {d.message}" for d in errors))
        self.diagnostics = tuple(diagnostics)


@dataclass(frozen=True, slots=True)
class Loaded:
    """A program ready to run, the warnings it came with, and its source as far as it is known."""

    program: Program
    diagnostics: tuple[Diagnostic, ...]
    source: Source


def cell_names(cell: Cell) -> CellNames:
    """What the compiler is told of a cell."""
    index = cell.names()
    return CellNames(
        points=index.points,
        joint_points=index.joint_points,
        tools=index.tools,
        frames=index.frames,
        conveyors=index.conveyors,
        inputs=range(1, index.digital_inputs + 1),
        outputs=range(1, index.digital_outputs + 1),
        joints=index.joints,
        auxiliary=index.auxiliary,
        asynchronous=index.asynchronous,
        analog_inputs=range(1, index.analog_inputs + 1),
        analog_outputs=range(1, index.analog_outputs + 1),
        live_points=frozenset(i for i, point in cell.points.items() if point.live),
        live_frames=frozenset(i for i, frame in cell.frames.items() if frame.live),
        point_names=index.point_names,
        signal_names=index.signal_names,
        variables=index.variables,
    )


Checked = tuple[CompileResult | None, tuple[Diagnostic, ...]]


def check_file(path: str | Path, cell: Cell | None = None) -> Checked:
    """Compile a program file without raising; no result where the file cannot be read."""
    read = read_source(path)
    if read.source is None:
        return None, tuple(read.diagnostics)
    result = compile_source(read.source, cell_names(cell) if cell is not None else None)
    return result, (*read.diagnostics, *result.diagnostics)


def compile_file(path: str | Path, cell: Cell | None = None) -> Loaded:
    """Compile a `.via` file, or load a `.viac` file; raises CompileError holding all diagnostics."""
    if Path(path).suffix == ".viac":
        return _load_compiled(Path(path))
    result, diagnostics = check_file(path, cell)
    if result is None or result.program is None or has_errors(diagnostics):
        raise CompileError(diagnostics)
    return Loaded(result.program, diagnostics, result.tree.source)


def compile_text(text: str, name: str = "<text>", cell: Cell | None = None) -> Loaded:
    """Compile a program given as text; raises CompileError holding all diagnostics."""
    result = compile_source(Source(name, text), cell_names(cell) if cell is not None else None)
    if result.program is None:
        raise CompileError(result.diagnostics)
    return Loaded(result.program, result.diagnostics, result.tree.source)


def _load_compiled(path: Path) -> Loaded:
    try:
        data = path.read_bytes()
    except OSError as error:
        reason = error.strerror or type(error).__name__
        unreadable = Diagnostic(code="E100", message=f"cannot read the file: {reason}", file=str(path))
        raise CompileError([unreadable]) from None
    try:
        program = load(data)
    except ProgramFileError as error:
        raise CompileError([Diagnostic(code=error.code, message=error.message, file=str(path))]) from None
    return Loaded(program, (), Source(program.name, "\n".join(program.source_lines())))
