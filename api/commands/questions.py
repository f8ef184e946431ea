"""How a command asks the person at the terminal."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from gaplab.api.clients.confirmation import Ask, is_yes
from gaplab.api.clients.screen import printable
from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.json_output import echo


@contextmanager
def keyboard() -> Iterator[Ask | None]:
    """Yield a function that asks a person at the terminal, even if standard input is a file; None without one."""
    if not sys.stdout.isatty():
        yield None
        return
    try:
        terminal = open("/dev/tty", "r+b", buffering=0)  # noqa: SIM115 - closed below
    except OSError:
        yield input if sys.stdin.isatty() else None
        return
    with terminal:

        def ask(question: str) -> str:
            terminal.write(question.encode())
            return terminal.readline().decode(errors="replace")

        yield ask


def confirmed(doubts: Sequence[str]) -> bool:
    """Ask about what is doubtful; return whether a person says that it is right, False without doubts or a terminal.

    Raises:
        CommandError: the person says that it is not.
    """
    for doubt in doubts:
        echo(f"doubtful: {doubt}", err=True)
    with keyboard() as ask:
        if not doubts or ask is None:
            return False
        _demand(ask, "Send it all the same?", "nothing was sent")
        return True


def demand_yes(what: str) -> None:
    """Ask whether to delete it for good; raise CommandError if the answer is not yes, or there is no terminal."""
    with keyboard() as ask:
        if ask is None:
            raise CommandError(f"to delete {what} for good without a terminal, add --yes", Exit.USAGE)
        _demand(ask, f"Delete {what} for good?", "nothing was deleted")


def _demand(ask: Ask, question: str, otherwise: str) -> None:
    try:
        answer = ask(printable(f"{question} [y/N] "))
    except (KeyboardInterrupt, EOFError):
        answer = ""
    if not is_yes(answer):
        raise CommandError(otherwise, Exit.INTERRUPTED)
