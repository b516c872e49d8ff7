"""Cell files: read, checked as a whole, built."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from viapoint.language.diagnostics import Diagnostic
from viapoint.language.source import Source
from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import geometry, io, members
from viapoint.runtime.cell import robot as robots
from viapoint.runtime.cell.checking import Checker
from viapoint.runtime.cell.model import Cell, Conveyor, DefaultSpeed, Filter, Floats, Frame
from viapoint.runtime.documents import (
    CELL_CODES,
    Document,
    DocumentError,
    Fault,
    Key,
    check,
    parse_document,
    read_document,
)
from viapoint.runtime.rotations import invert_pose

if TYPE_CHECKING:
    from viapoint.runtime.cell.schema import CellFile
    from viapoint.runtime.cell.schema import DefaultSpeed as DefaultSpeedSection


class CellError(DocumentError):
    """A cell that cannot be used; `diagnostics` holds every reason, each with key and line."""


def load_cell(path: str | Path) -> Cell:
    """The cell of a file with one robot. Raises CellError with all diagnostics."""
    return _only(load_cells(path))


def parse_cell(text: str, name: str = "<cell>") -> Cell:
    """The cell of a text; relative paths in it start at the name's folder. Raises CellError."""
    return _only(parse_cells(text, name))


def load_cells(path: str | Path) -> tuple[Cell, ...]:
    """The cell of a file as each of its robots sees it, one or several. Raises CellError."""
    try:
        document = read_document(Path(path), CELL_CODES)
    except DocumentError as error:
        raise CellError(error.diagnostics) from None
    return _build_all(document)


def parse_cells(text: str, name: str = "<cell>") -> tuple[Cell, ...]:
    """As `load_cells`, of a text. Raises CellError."""
    try:
        document = parse_document(name, text, CELL_CODES)
    except DocumentError as error:
        raise CellError(error.diagnostics) from None
    return _build_all(document)


def _only(cells: tuple[Cell, ...]) -> Cell:
    if len(cells) == 1:
        return cells[0]
    message = f"the cell has {len(cells)} robots, and one program is run by one"
    hint = "run the cell itself: viapoint run --cell FILE"
    raise CellError([Diagnostic(code="E279", message=message, file=cells[0].source.name, hint=hint)])


def _build_all(document: Document) -> tuple[Cell, ...]:
    from viapoint.runtime.cell.schema import CellFile

    if not members.has_several(document):
        return (_build(document, CellFile),)
    documents, faults = members.taken_apart(document)
    cells = []
    for number, each in enumerate(documents, start=1):
        try:
            cells.append(_build_member(each, number))
        except CellError as error:
            faults += [fault for fault in error.diagnostics if fault not in faults]
    if not faults:
        faults += _apart(document, cells)
    if faults:
        raise CellError(faults)
    return tuple(cells)


def _apart(document: Document, cells: Sequence[Cell]) -> list[Diagnostic]:
    """What does not go together in robots of one cell."""
    faults = []
    names: set[str] = set()
    if not cells:
        faults.append(document.fault(Fault.LENGTH, ("robots",), "the cell has no robot"))
    for i, cell in enumerate(cells):
        if cell.tick != cells[0].tick:
            key: Key = ("robots", i, "controller", "tick_s")
            message = f"all robots of a cell run on one tick, {cells[0].tick:g} s"
            faults.append(
                document.fault(Fault.CONTRADICTION, key, message, "put tick_s at the top of the file")
            )
        if cell.robot_name in names:
            key = ("robots", i, "name")
            faults.append(document.fault(Fault.DUPLICATE, key, f"the name {cell.robot_name} is used twice"))
        if cell.robot_name is not None:
            names.add(cell.robot_name)
    return faults


def _build(document: Document, schema: type[CellFile]) -> Cell:
    document, faults = _with_points(document)
    checked = check(document, schema)
    faults += checked.faults
    cell = None
    if checked.model is not None:
        checker = Checker(document)
        cell = _assemble(checker, checked.model)
        faults += checker.faults(checked.dropped)
    if faults or cell is None:
        raise CellError(faults)
    return cell


def _build_member(document: Document, number: int) -> Cell:
    from viapoint.runtime.cell.schema import MemberFile

    cell = _build(document, MemberFile)
    conveyors, faults = _belts(document, cell)
    if faults:
        raise CellError(faults)
    program = document.data.get("program")
    return replace(
        cell,
        conveyors=conveyors,
        number=number,
        robot_name=document.data.get("name"),
        program=None if program is None else Path(document.name).parent / program,
        priority=document.data.get("priority", 0),
    )


def _belts(document: Document, cell: Cell) -> tuple[dict[int, Conveyor], list[Diagnostic]]:
    """The conveyors with the windows that the robot has on them."""
    conveyors, faults = dict(cell.conveyors), []
    for i, each in enumerate(document.data.get("belts", ())):
        key: Key = ("belts", i)
        found = conveyors.get(each["index"])
        low, high = each["window_mm"]
        if found is None or found.parts is None:
            what = "there is no conveyor" if found is None else "no parts come on conveyor"
            faults.append(document.fault(Fault.REFERENCE, (*key, "index"), f"{what} {each['index']}"))
        elif low >= high:
            message = "the window for parts is empty"
            faults.append(document.fault(Fault.CONTRADICTION, (*key, "window_mm"), message))
        else:
            taught = each.get("taught_mm", found.parts.taught / MM) * MM
            parts = replace(found.parts, window=(low * MM, high * MM), taught=taught)
            conveyors[found.index] = replace(found, parts=parts)
    return conveyors, faults


def _with_points(document: Document) -> tuple[Document, list[Diagnostic]]:
    """`points = "file"` replaced by what the file holds."""
    name = document.data.get("points")
    if not isinstance(name, str):
        return document, []
    path = Path(document.name).parent / name
    try:
        return document.with_part("points", read_document(path, CELL_CODES)), []
    except DocumentError as error:
        without = {key: value for key, value in document.data.items() if key != "points"}
        return replace(document, data=without), list(error.diagnostics)


def _assemble(checker: Checker, file: CellFile) -> Cell | None:
    """The cell of a checked file; None, with faults, where its robot is not known."""
    robot = robots.build_robot(checker, file)
    if robot is None:
        return None
    X_world_base = geometry.frame_pose(file.robot.zero_frame)
    X_base_zero = invert_pose(X_world_base)  # F 4-28
    frames = _frames(checker, file, X_base_zero)
    axes = robots.build_auxiliary(checker, file)
    controller = file.controller
    return Cell(
        robot=robot,
        home=robots.build_home(checker, file, robot),
        X_world_base=X_world_base,
        tick=controller.tick_s,
        lookahead=controller.lookahead,
        default_speed=_default_speed(controller.default_speed),
        profile=controller.profile,
        path_tolerance=controller.path_tolerance_mm * MM,
        filter=Filter(ticks=controller.filter.ticks, sigma=controller.filter.sigma),
        emergency_deceleration_factor=controller.emergency_deceleration_factor,
        tracking_reserve=controller.tracking_reserve,
        mm_per_deg=controller.mm_per_deg,
        path_limits=robots.path_limits(file.limits.path),
        points=geometry.build_points(checker, file.points, robot, axes),
        tools={0: geometry.no_tool()} | checker.indexed("tools", file.tools, geometry.build_tool),
        frames=frames,
        io=io.build_io(checker, file.io, io.build_variables(checker, file)),
        m_functions=io.build_m_functions(checker, file),
        conveyors=checker.indexed(
            "conveyors",
            file.conveyors,
            lambda key, each: geometry.build_conveyor(checker, key, each, X_base_zero),
        ),
        zones=geometry.build_zones(checker, file, frames),
        orientation_cone=geometry.build_cone(checker, file.orientation_cone),
        auxiliary_axes=axes,
        drives=robots.build_drives(checker, file, robot),
        source=Source(checker.document.name, checker.document.text),
        points_source=_points_source(checker.document),
    )


def _frames(checker: Checker, file: CellFile, X_base_zero: Floats) -> dict[int, Frame]:
    zero = Frame(index=0, name=None, X_base_frame=X_base_zero, live=False)
    return {0: zero} | checker.indexed(
        "frames", file.frames, lambda _, each: geometry.build_frame(each, X_base_zero)
    )


def _default_speed(section: DefaultSpeedSection) -> DefaultSpeed:
    return DefaultSpeed(path=section.path_mm_s * MM, joint=section.joint_deg_s * DEG)


def _points_source(document: Document) -> Source | None:
    part = document.parts.get("points")
    return None if part is None else Source(part.name, part.text)
