"""The same computation by the numpy twins and by the compiled modules, for the tests that compare the two."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import pytest

from viapoint.runtime import core

Result = TypeVar("Result")


def by_both(compute: Callable[[], Result], name: str) -> tuple[Result, Result]:
    """What `compute` gives without and with the compiled modules; `name` is one that it uses.

    Where that was not built, `auto` has to come to the twin.
    """
    other = "auto" if core.built(name) is None else "compiled"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(core, "asked", "python")
        assert core.chosen(name) is None
        twin = compute()
        patch.setattr(core, "asked", other)
        assert core.chosen(name) is core.built(name)
        return twin, compute()
