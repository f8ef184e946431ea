"""Strategies that do harm: their names, and which experiments are themselves at fault."""

from pathlib import Path
from typing import Any

PREFIX = "misbehaving"
"""Begins the names of strategies whose experiments are themselves at fault."""

FOLDER = Path(__file__).parent / "plugins"

HARMLESS = ("raises", "prints", "ends_process")
"""Those that end by themselves, and soon."""

HARMFUL = ("exits", "hangs", "returns_row", "returns_scalar", "returns_nothing", "returns_nan")
"""Those that the checks and limits of the worker end."""


def at_fault(spec: Any) -> bool:
    """Whether an experiment is itself at fault, so that it may fail."""
    return str(spec["strategy"]["name"]).startswith(PREFIX)
