"""Progress in words and colours."""

import re
from pathlib import Path

import pytest
from rich.table import Table

from gaplab.api.clients import screen
from gaplab.api.clients.progress import COLORS
from gaplab.api.clients.screen import console
from gaplab.api.commands.json_output import echo, print_json
from gaplab.schemas.lifecycle import State


def test_every_state_has_a_colour() -> None:
    assert set(COLORS) == set(State)


@pytest.mark.parametrize("is_terminal", [False, True])
def test_no_name_reaches_the_terminal_as_an_order(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, is_terminal: bool
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1" if is_terminal else "")
    name, shown = "evil\x1b[2J\x9b31m\x7f", console()
    table = Table("name")
    table.add_row(name)

    echo(name)
    print_json({name: 1})
    shown.print(table, f"[green]{name}[/]")
    printed = capsys.readouterr().out

    assert not {"\x9b", "\x7f"} & set(printed)
    assert "\x1b[2J" not in printed
    assert "evil\\u001b[2J\\u009b31m\\u007f" in printed
    assert ("\x1b[32m" in printed) is is_terminal


def test_the_command_prints_through_one_place_alone() -> None:
    folder = Path(screen.__file__).parents[1]
    printing = {
        file.name for file in folder.rglob("*.py") if re.search(r"typer\.s?echo|[^(]Console\(", file.read_text())
    }

    assert printing == {"json_output.py", "cli.py", "progress.py"}  # `help` prints its own texts, `progress` HTML
