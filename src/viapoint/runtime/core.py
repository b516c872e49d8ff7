"""Which numerics do the work: compiled modules where they were built, else numpy twins of the same face.

A room of the runtime that has a compiled module (`_name.pyx` beside the twin) asks here whether to use
it. The environment variable VIAPOINT_CORE decides: `python`, `compiled` (an error if it was not built),
or `auto`, the default. Both give the same results to rounding.
"""

from __future__ import annotations

import importlib
import os
from functools import cache
from types import ModuleType
from typing import Final

VARIABLE: Final = "VIAPOINT_CORE"
asked = os.environ.get(VARIABLE, "auto")
"""What the environment asked for when the process began; looked at in every call of `chosen`."""


@cache
def built(name: str) -> ModuleType | None:
    """The compiled module `name` below viapoint.runtime, such as "timing._core"; None if not built."""
    try:
        return importlib.import_module(f"viapoint.runtime.{name}")
    except ImportError:
        return None


def chosen(name: str) -> ModuleType | None:
    """The compiled module that shall do the work, None where the twin shall.

    Raises ValueError for a word in VIAPOINT_CORE that is not known, or a compiled core that was not built.
    """
    return _chosen(name, asked)


@cache
def _chosen(name: str, asked: str) -> ModuleType | None:
    if asked not in ("auto", "python", "compiled"):
        raise ValueError(f"{VARIABLE} must be auto, python or compiled, not {asked!r}")
    module = None if asked == "python" else built(name)
    if module is None and asked == "compiled":
        raise ValueError(f"{VARIABLE} asks for the compiled core, which was not built")
    return module
