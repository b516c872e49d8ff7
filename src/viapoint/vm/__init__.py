"""The virtual machine: instruction table, program file, verifier, disassembler, machine; knows no robot."""

from viapoint.vm.canonical import CanonicalPort, ScriptedWorld, describe, run_canonical
from viapoint.vm.container import save
from viapoint.vm.disassembler import disassemble
from viapoint.vm.frames import ActiveCall
from viapoint.vm.machine import Machine
from viapoint.vm.ports import BEGINNING, Modal
from viapoint.vm.program import Program, Span
from viapoint.vm.refusal import ProgramFileError
from viapoint.vm.verifier import load, verify

__all__ = [
    "BEGINNING",
    "ActiveCall",
    "CanonicalPort",
    "Machine",
    "Modal",
    "Program",
    "ProgramFileError",
    "ScriptedWorld",
    "Span",
    "describe",
    "disassemble",
    "load",
    "run_canonical",
    "save",
    "verify",
]
