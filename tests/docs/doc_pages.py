"""The fenced blocks of README.md and docs/, and the steps that a reader takes in them, in order."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = {str(path.relative_to(ROOT)): path for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))}

DIRECTIVE = re.compile(r"\{[\w:-]+\}")  # of the site's generator, which runs it itself
OPENING = re.compile(r"\s*(`{3,}|:{3,})\s*(.*?)\s*$")


@dataclass(frozen=True)
class Block:
    """A fenced block: ``line`` is that of its fence, ``language`` the first word after it."""

    page: str
    line: int
    language: str
    text: str


@dataclass(frozen=True)
class Step:
    """What is done at once: a shell command, or a whole block of another language."""

    page: str
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page}:{self.line}: {self.text}"


def blocks(page: str) -> list[Block]:
    """Return the blocks of a page; raises ValueError for a fence that is not closed."""
    found, opened = list[Block](), None
    for number, line in enumerate(PAGES[page].read_text().splitlines(), 1):
        fence = OPENING.match(line)
        if opened is None:
            if fence and not (fence[1].startswith(":") or "`" in fence[2]):
                opened = (number, fence[1], (fence[2].split() or [""])[0], list[str]())
        elif fence and fence[1] == opened[1] and not fence[2]:
            indent = len(line) - len(line.lstrip())
            text = "\n".join(each[indent:] for each in opened[3])
            found.append(Block(page, opened[0], opened[2], text + "\n"))
            opened = None
        else:
            opened[3].append(line)
    if opened is not None:
        raise ValueError(f"{page}:{opened[0]}: the fence is not closed")
    return [block for block in found if not DIRECTIVE.fullmatch(block.language)]


def steps(page: str) -> list[Step]:
    """Return the steps of a page in order."""
    return [step for block in blocks(page) for step in _steps(block)]


def _steps(block: Block) -> Iterator[Step]:
    if block.language != "sh":
        yield Step(block.page, block.line, block.language, block.text)
        return
    lines = block.text.splitlines()
    start = 0
    while start < len(lines):
        end = start + 1
        while end < len(lines) and _goes_on("\n".join(lines[start:end])):
            end += 1
        text = "\n".join(lines[start:end]).strip()
        if text and not text.startswith("#"):
            yield Step(block.page, block.line + 1 + start, "sh", text)
        start = end


def _goes_on(text: str) -> bool:
    """Tell whether a command has its next line in it too: a backslash, a here-document, an open quote."""
    heredoc = re.search(r"<<-?\s*['\"]?(\w+)", text)
    if heredoc:
        return text.splitlines()[-1].strip() != heredoc[1]
    if text.endswith("\\"):
        return True
    try:
        shlex.split(text, comments=True)
    except ValueError:
        return True
    return False
