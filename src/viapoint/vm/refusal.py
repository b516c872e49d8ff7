"""The one exception of program files. It carries its catalogue code and nothing else."""

from __future__ import annotations


class ProgramFileError(Exception):
    """A program file that is refused: `code` of the catalogue (E250 to E259) and `message`."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(f"{code}: {message}")
        self.code = code
        self.message = message
