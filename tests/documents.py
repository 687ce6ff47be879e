"""The written pages, README among them, and the code in them."""

from __future__ import annotations

import re
from pathlib import Path

from paths import ROOT

README = ROOT / "README.md"
PAGES = ROOT / "docs" / "pages"
DOCUMENTS = (README, *sorted(PAGES.rglob("*.md")))

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def name_of(document: Path) -> str:
    """A document's path in the repository."""
    return str(document.relative_to(ROOT))


def blocks(document: Path, *languages: str) -> list[str]:
    """The bodies of the blocks of code in some languages, in order."""
    return [body for name, body in _BLOCK.findall(document.read_text("utf-8")) if name in languages]


def named_file(body: str) -> str | None:
    """The file that a block says it is, in a comment on its first line."""
    match = re.match(r"# (\w+\.(?:py|yaml))\n", body)
    return match.group(1) if match else None


def command_lines(document: Path) -> list[str]:
    """What stands after `trust-env` in shell blocks and in code spans of the text."""
    text = document.read_text("utf-8")
    lines = [line for body in blocks(document, "sh") for line in body.splitlines()]
    spans = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL))
    found = [text.removeprefix("trust-env ") for text in lines + spans if text.startswith("trust-env ")]
    return [line.partition(" > ")[0].replace("\\|", "|") for line in found]
