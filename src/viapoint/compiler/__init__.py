"""The compiler: names, checks, lowering. Text in, program or diagnostics out; pure."""

from viapoint.compiler.cell_names import CellNames
from viapoint.compiler.compilation import CompileResult, compile_source, compile_tree
from viapoint.compiler.reports import Decision, decision_report

__all__ = ["CellNames", "CompileResult", "Decision", "compile_source", "compile_tree", "decision_report"]
