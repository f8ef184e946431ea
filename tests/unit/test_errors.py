"""The tree of errors, as it is drawn."""

import re
from collections.abc import Iterator

from gaplab.services.core import errors
from gaplab.services.core.errors import GaplabError


def drawn() -> Iterator[tuple[str, str]]:
    """Each error of the tree in the docstring, with its parent."""
    above: list[str] = []
    for branch, name in re.findall(r"^([ │├└─]{4,})(\w+)", errors.__doc__ or "", re.MULTILINE):
        above = [*above[: len(branch) // 4 - 1], name]
        if above[:-1]:
            yield name, above[-2]


def defined(parent: type[GaplabError] = GaplabError) -> Iterator[tuple[str, str]]:
    """Each error of gaplab below a parent, with its own parent."""
    for error in parent.__subclasses__():
        if error.__module__.startswith("gaplab."):
            yield error.__name__, parent.__name__
            yield from defined(error)


def test_the_tree_draws_every_error_below_its_parent() -> None:
    assert sorted(drawn()) == sorted(defined())
