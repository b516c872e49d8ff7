"""Programs, cells and scenarios from the files that a command line names; refused with diagnostics."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from viapoint.cli.failures import Refusal

if TYPE_CHECKING:
    from viapoint.language.diagnostics import Diagnostic
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.signals import Scenario
    from viapoint.session import Loaded
    from viapoint.vm import Program


def cell_from(path: Path | None, program: Path | None = None) -> Cell:
    """The cell in `path`; without one, the built-in cell. Of several robots, the one that runs `program`."""
    cells = cells_from(path)
    if len(cells) == 1:
        return cells[0]
    own = [cell for cell in cells if _runs(cell, program)]
    own = own or [cell for cell in cells if cell.program is None]
    if not own:
        raise Refusal(f"the cell {path} has {len(cells)} robots, and none of them runs {program}")
    return own[0]


def cells_from(path: Path | None) -> tuple[Cell, ...]:
    """The cell in `path` as each of its robots sees it; without one, the built-in cell."""
    from viapoint.runtime.cell import default_cell, load_cells
    from viapoint.runtime.documents import DocumentError

    if path is None:
        return (default_cell(),)
    try:
        return load_cells(path)
    except DocumentError as error:
        raise Refusal(f"the cell {path} cannot be used", error.diagnostics) from error


def _runs(cell: Cell, program: Path | None) -> bool:
    return program is not None and cell.program is not None and cell.program.resolve() == program.resolve()


def programs_from(cells: tuple[Cell, ...], program: Path | None) -> tuple[Loaded, ...]:
    """A program per robot: its own, or else `program`."""
    from viapoint.session import CompileError
    from viapoint.station import compile_programs

    try:
        return compile_programs(cells, program)
    except CompileError as error:
        raise Refusal("the programs of the cell cannot be run", error.diagnostics) from error


def scenario_from(path: Path | None, cell: Cell) -> Scenario | None:
    from viapoint.runtime.documents import DocumentError
    from viapoint.runtime.signals import load_scenario

    if path is None:
        return None
    try:
        return load_scenario(path, cell)
    except DocumentError as error:
        raise Refusal(f"the scenario {path} cannot be used", error.diagnostics) from error


def program_from(path: Path, cell: Cell) -> Loaded:
    """The program in `path`, .via or .viac, ready to run."""
    from viapoint.session import CompileError, compile_file

    try:
        return compile_file(path, cell)
    except CompileError as error:
        raise Refusal(f"the program {path} cannot be run", error.diagnostics) from error


def bytecode_from(path: Path, cell: Cell | None) -> tuple[Program, tuple[Diagnostic, ...]]:
    """The program in `path` and its warnings; without a cell no robot and no numerics are loaded."""
    from viapoint.checking import compile_only

    checked = compile_only(path, cell)
    if checked.program is None:
        raise Refusal(f"the program {path} has errors", checked.diagnostics)
    return checked.program, checked.diagnostics
