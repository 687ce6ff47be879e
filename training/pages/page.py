"""A page from its template: styles, scripts and data stand in the file itself."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from trust_env.files import write_atomically

_FOLDER = Path(__file__).parents[1]  # of templates, styles and scripts, which lie beside the code that fills them


def render(template: str, **values: Any) -> str:
    """The text of a template, as "replays/page.html.j2"; whatever it shows is escaped, and a name that is `breakable`
    goes on in another line between its parts.

    A template can ask for `file("replays/map.js")`, another file as it is, and for `data(value)`, plain values as JSON.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    loader = FileSystemLoader(_FOLDER)
    templates = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    templates.globals["file"] = lambda name: Markup((_FOLDER / name).read_text("utf-8"))
    templates.filters["breakable"] = _breakable
    templates.globals["data"] = lambda value: Markup(as_script_data(value))
    return templates.get_template(template).render(values)


def _breakable(name: str) -> Any:
    from markupsafe import Markup, escape

    return Markup(re.sub(r"([_=/:])", r"\1<wbr>", str(escape(name)).replace("(", "<wbr>(")))


def as_script_data(value: Any) -> str:
    """JSON that can stand within a <script> element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def save_page(file: Path, text: str) -> None:
    """Write a page, whole or not at all. OSError: it cannot be written."""
    write_atomically(file, lambda unfinished: unfinished.write_text(text, encoding="utf-8"))
