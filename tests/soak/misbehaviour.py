"""Strategies that do harm: their names, and which experiments are themselves at fault."""

from pathlib import Path
from typing import Any

PREFIX = "misbehaving"
"""Begins the names of strategies whose experiments are themselves at fault."""

FOLDER = Path(__file__).parent / "plugins"

HARMLESS = ("raises", "prints", "ends_process")
"""Those that the service bears."""

HARMFUL = ("exits", "hangs", "returns_row", "returns_scalar", "returns_nothing", "returns_nan")
"""Those that need limits and checks in the worker; `--plug-ins all` injects them too."""


def at_fault(spec: Any) -> bool:
    """Whether an experiment is itself at fault, so that it may fail."""
    return str(spec["strategy"]["name"]).startswith(PREFIX)
