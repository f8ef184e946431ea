"""Objects of SAPIEN."""

from typing import Any, TypeAlias

Handle: TypeAlias = Any
"""An object of SAPIEN, untyped because the library must not be imported here."""
