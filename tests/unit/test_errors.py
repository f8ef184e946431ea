"""Each error that a request may meet has a kind, and each kind a status."""

from collections.abc import Iterator

from gaplab.api import app
from gaplab.api.http.problems import STATUSES
from gaplab.services.core.errors import GaplabError


def errors(parent: type[GaplabError] = GaplabError) -> Iterator[type[GaplabError]]:
    """Each error of gaplab below a parent, as far as the service imports them."""
    for error in parent.__subclasses__():
        if error.__module__.startswith("gaplab."):
            yield error
            yield from errors(error)


def test_each_kind_of_error_has_a_status_and_a_title() -> None:
    assert app
    found = [each for each in errors() if each.kind]

    assert {each.kind for each in found} == set(STATUSES)
    assert all(each.title for each in found)
