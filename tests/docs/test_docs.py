"""What the documentation shows is what happens: every block runs, every link leads somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from doc_blocks import Mismatch, Room, compare
from doc_pages import DOCS, REPOSITORY, Page, read_page

GENERATED = {"diagnostics.md", "instructions.md", "language-commands.md"}
"""Made from tables whose examples have tests of their own; `make docs-check` judges these pages."""

PAGES = [REPOSITORY / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
PAGES += sorted(DOCS.glob("*.md"))
WRITTEN = [path for path in PAGES if path.name not in GENERATED]


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_blocks_of_a_page(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """`--update-goldens` writes the present output of console blocks into the page."""
    monkeypatch.chdir(tmp_path)
    page, room = read_page(path), Room(tmp_path)
    text, wrong = page.text, []
    room.furnish(page.blocks())
    for block in page.blocks():
        try:
            room.run(block)
        except Mismatch as error:
            if error.now is not None and request.config.getoption("--update-goldens"):
                text = text.replace(block.text, error.now)
            else:
                wrong.append(f"{page.name}:{block.line}: {error}")
    if text != page.text:
        path.write_text(text, encoding="utf-8")
    assert not wrong, "\n\n".join(wrong)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_links_lead_somewhere(path: Path) -> None:
    page = read_page(path)
    for link in page.links():
        target, _, anchor = link.partition("#")
        other = (path.parent / target).resolve() if target else path
        assert other.exists(), link
        if anchor and other.suffix == ".md":
            assert anchor in read_page(other).anchors(), link


def test_the_index_names_every_page() -> None:
    linked = {link.partition("#")[0] for link in read_page(DOCS / "index.md").links()}
    assert {path.name for path in DOCS.glob("*.md")} - {"index.md"} <= linked


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_codes_named_exist(path: Path) -> None:
    from viapoint.language.catalogue import CATALOGUE

    named = set(re.findall(r"\b[EWI][1-6][0-9]{2}\b", read_page(path).text))
    assert named <= set(CATALOGUE)


def test_make_targets_named_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (REPOSITORY / "Makefile").read_text(), flags=re.MULTILINE))
    for path in WRITTEN:
        named = re.findall(r"(?:^|`)make ([a-z-]+)", read_page(path).text, flags=re.MULTILINE)
        assert set(named) <= targets, path.name


# --- the machinery itself ---------------------------------------------------------------------------


def _page(text: str) -> Page:
    return Page(DOCS / "made-up.md", text)


def test_blocks_are_found_with_what_is_said_above() -> None:
    text = "<!-- run -->\n<!-- file: a.via -->\n\n```via\nML P1\n```\n\nprose\n\n```toml\n```\n"
    first, second = _page(text).blocks()
    assert (first.language, first.text, first.line) == ("via", "ML P1\n", 4)
    assert first.says == {"run": "", "file": "a.via"}
    assert (second.language, second.says) == ("toml", {})


@pytest.mark.parametrize(
    ("block", "why"),
    [
        ("```via\nML P1 P2\n```", "E122"),
        ("<!-- error: E201 -->\n```via\nML P1 F100\n```", "refused"),
        ("<!-- run -->\n```via\nML X=9000 F100\n```", "ends with error"),
        ("<!-- fails: E302 -->\n```via\nML P1 F900\n```", "ends with finished"),
        ("<!-- section -->\n```toml\n[points]\nP1 = { x = 1 }\n```", "E273"),
        ("```console\n$ viapoint robots\nnobody\n```", "it shows"),
        ("<!-- exit: 1 -->\n```console\n$ viapoint robots\n…\n```", "exit code"),
        ("```python\nprint(1)\n```\n<!-- printed -->\n```text\none\n```", "it shows"),
    ],
)
def test_a_wrong_block_is_noticed(
    block: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    room = Room(tmp_path)
    *before, wrong = _page(block).blocks()
    for each in before:
        room.run(each)
    with pytest.raises(Mismatch, match=why):
        room.run(wrong)


def test_gaps_stand_for_any_lines() -> None:
    compare("a\n…\nd\n", "a\nb\nc\nd\n", exact=True)
    compare("a 1\n…\n", "a  2\nb\n", exact=False)
    with pytest.raises(Mismatch):
        compare("a\n…\nc\n", "a\nb\nc\nd\n", exact=True)
    with pytest.raises(Mismatch):
        compare("…\nx\n…\n", "a\nb\n", exact=True)


def test_anchors_are_spelt_as_on_github() -> None:
    assert _page("# What `R` does: corners, speeds\n").anchors() == {"what-r-does-corners-speeds"}
