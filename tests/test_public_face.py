"""The library's face: every public name is there, and importing the package loads nothing heavy."""

from __future__ import annotations

import subprocess
import sys

import viapoint


def test_every_public_name_can_be_imported() -> None:
    for name in viapoint.__all__:
        assert getattr(viapoint, name).__name__ == name
    assert set(viapoint.__all__) <= set(dir(viapoint))
    assert set(viapoint.__all__) == set(viapoint._HOME_OF)


def test_unknown_names_are_missing() -> None:
    assert not hasattr(viapoint, "nothing_of_the_kind")


def test_import_loads_no_numerics() -> None:
    code = "import sys, viapoint; print('numpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout == "False\n"
