"""What the contracts of all kinds ask of a description."""

from typing import Any


def is_described(plugin: type[Any]) -> None:
    """Has a docstring of its own, whose first line is a sentence."""
    assert (plugin.__doc__ or "").strip(), "it has no docstring of its own; say in a sentence what it does"
    summary = plugin.describe().summary
    assert summary.endswith("."), f"its summary in the catalogue is {summary!r}; end it with a full stop"
