"""Sittings start in the folder of the test files."""

from __future__ import annotations

import pytest
from repl_sittings import FILES, Sitting


@pytest.fixture
def sitting(monkeypatch: pytest.MonkeyPatch) -> Sitting:
    monkeypatch.chdir(FILES)
    return Sitting()
