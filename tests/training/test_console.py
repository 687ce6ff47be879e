"""Tables in narrow terminals."""

import io

import pytest
from rich.console import Console
from rich.table import Table
from rich.text import Text

from trust_env.training.console import print_table


def printed(width: int) -> str:
    table = Table("environment", "", title="What was found")
    table.add_column(Text("damage per frame"))
    table.add_row("trio x score", Text("[bold]"), "1.02\n[0.97, 1.04]")
    table.add_row("", "", "123456789.5")
    console = Console(width=width, file=io.StringIO())
    print_table(console, table)
    return console.file.getvalue()  # type: ignore[attr-defined]


@pytest.mark.parametrize("width", [10, 20, 40, 80])
def test_every_width_shows_every_word(width):
    text = printed(width)
    assert max(map(len, text.splitlines())) <= max(width, 11) and "…" not in text
    for word in ("trio", "score", "[0.97,", "1.04]", "[bold]", "123456789.5", "environment", "found"):
        assert word in text or width < len(word)


def test_what_does_not_fit_side_by_side_is_a_line_for_every_entry():
    text = printed(30)
    assert "environment: trio x score\n[bold]\ndamage per frame: 1.02 [0.97, \n1.04]\n" in text
    assert "┃" not in text and "┃" in printed(60)
