"""What README and docs show: commands and snippets, where they stand, and what inline code names."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
COMMANDS = ("", "sh", "bash", "console")
"""languages of blocks in which every line is a command; output is `text`"""


class Block(NamedTuple):
    """A fenced block."""

    language: str
    text: str


def blocks(markdown: str) -> list[Block]:
    """The fenced blocks of a document, in order."""
    return [Block(info.split(" ")[0], text) for info, text in FENCE.findall(markdown)]


def commands(block: Block) -> list[str]:
    """The commands of a block, without comments and without the place of our own environment."""
    if block.language not in COMMANDS:
        return []
    lines = block.text.replace("\\\n", " ").splitlines()
    shown = [re.sub(r"(^|\s)#.*$", "", line).strip() for line in lines]
    return [line.removeprefix("$ ").removeprefix(".venv/bin/") for line in shown if line]


def file_name(block: Block) -> str | None:
    """The name of the file that a block of TOML or Python is, where its first line says so."""
    ends = {"toml": "toml", "python": "py"}
    first = re.match(r"# ([\w./-]+\.(\w+))\n", block.text)
    return first[1] if first and ends.get(block.language) == first[2] else None


def shown() -> list[tuple[str, str]]:
    """(document, command) of every command in a block of its own."""
    return [
        (name(document), command)
        for document in DOCUMENTS
        for block in blocks(document.read_text())
        for command in commands(block)
    ]


def inline(markdown: str) -> list[list[str]]:
    """The words of every command in the running text, such as `fgbaseline run --help`."""
    prose = FENCE.sub("", markdown)
    found = [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", prose)]
    programs = re.compile(r"(\.venv/bin/)?(fgbaseline|python|make) [\w-]")
    return [shlex.split(code.removeprefix(".venv/bin/")) for code in found if programs.match(code)]


def name(document: Path) -> str:
    """The document's path from the root of the project."""
    return document.relative_to(ROOT).as_posix()
