"""Pages of the documentation as programs: their fenced blocks, links and headings. No judgement of style.

A block is told what it is by its language, and by HTML comments on the lines above it, each a word or a
word and a value: `<!-- run -->`, `<!-- file: part.via -->`. What they do stands in `doc_blocks.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
DOCS = REPOSITORY / "docs"

_FENCE = re.compile(r"^(?P<fence>```+)(?P<language>\w*)\s*$")
_COMMENT = re.compile(r"^<!--\s*(?P<word>[a-z]+)(?::\s*(?P<value>.*?))?\s*-->$")
_HEADING = re.compile(r"^#+\s+(.*)$")
_LINK = re.compile(r"(?<!\!)\[[^\]]*\]\(([^)\s]+)\)")
_CODE = re.compile(r"`[^`]*`")


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block: its language, its text, what the comments above say, and its line on the page."""

    language: str
    text: str
    says: dict[str, str]
    line: int


@dataclass(frozen=True, slots=True)
class Page:
    """A Markdown file, read once."""

    path: Path
    text: str

    @property
    def name(self) -> str:
        """Path from the repository's root."""
        return self.path.relative_to(REPOSITORY).as_posix()

    def blocks(self) -> list[Block]:
        """All fenced blocks, in order."""
        return list(_blocks(self.text.splitlines()))

    def prose(self) -> list[str]:
        """The lines outside of fenced blocks."""
        return list(_prose(self.text.splitlines()))

    def anchors(self) -> set[str]:
        """What `#…` may name: headings as GitHub spells them."""
        found = (_HEADING.match(line) for line in self.prose())
        return {slug(heading[1]) for heading in found if heading is not None}

    def links(self) -> list[str]:
        """Targets of all links but those to other sites."""
        text = "\n".join(_CODE.sub("", line) for line in self.prose())
        return [target for target in _LINK.findall(text) if "://" not in target]

    def table_rows(self) -> Iterator[list[str]]:
        """Cells of every table row, without heads and rules."""
        for line in self.prose():
            if line.startswith("|") and not set(line) <= set("|-: "):
                yield [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def read_page(path: Path) -> Page:
    """The page in `path`."""
    return Page(path, path.read_text(encoding="utf-8"))


def slug(heading: str) -> str:
    """GitHub's anchor of a heading."""
    plain = re.sub(r"[^\w\- ]", "", heading.strip().lower())
    return plain.replace(" ", "-")


def _blocks(lines: list[str]) -> Iterator[Block]:
    says: dict[str, str] = {}
    start, body, fence, language = 0, [], "", ""
    for number, line in enumerate(lines, start=1):
        if fence:
            if line == fence:
                yield Block(language, "".join(f"{each}\n" for each in body), says, start)
                fence, says = "", {}
            else:
                body.append(line)
        elif (opened := _FENCE.match(line)) is not None:
            fence, language, start, body = opened["fence"], opened["language"], number, []
        elif (comment := _COMMENT.match(line)) is not None:
            says[comment["word"]] = comment["value"] or ""
        elif line.strip():
            says = {}
    assert not fence, f"the block of line {start} has no end"


def _prose(lines: list[str]) -> Iterator[str]:
    fence = ""
    for line in lines:
        opened = _FENCE.match(line)
        if fence:
            fence = "" if line == fence else fence
        elif opened is not None:
            fence = opened["fence"]
        else:
            yield line
