"""Fixtures of all tests.

Golden files are plain texts under tests/golden. `pytest --update-goldens` (the flag comes with
pytest-golden) rewrites those that differ, instead of failing; look at the difference before committing.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

GOLDEN = Path(__file__).parent / "golden"
"""Golden files of the tests beside this file."""
CheckGolden = Callable[[str, str], None]


@pytest.fixture
def check_golden(request: pytest.FixtureRequest) -> CheckGolden:
    """`check_golden("room/name.txt", text)`: the text equals the golden file, or becomes it."""
    update = request.config.getoption("--update-goldens")

    def check(name: str, text: str) -> None:
        compare_golden(GOLDEN / name, text, update=update)

    return check


def compare_golden(path: Path, text: str, *, update: bool) -> None:
    """Compare `text` with the file; with `update`, write it where it differs."""
    wanted = text if text.endswith("\n") else f"{text}\n"
    given = path.read_text(encoding="utf-8") if path.exists() else None
    if given == wanted:
        return
    if update:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(wanted, encoding="utf-8")
        return
    assert given is not None, f"{path} does not exist; make it with --update-goldens"
    assert wanted == given, f"{path} differs; rewrite it with --update-goldens if the new text is right"
