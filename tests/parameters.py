"""Parameters of which only some are for every change, and all for a release."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def few(values: Iterable[Any], kept: Callable[[Any], bool], name: Callable[[Any], str] = str) -> list[Any]:
    """The values as parameters; those that are not kept are for a release."""
    release = pytest.mark.release
    return [pytest.param(each, id=name(each), marks=() if kept(each) else release) for each in values]
