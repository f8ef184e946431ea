"""What the shell offers while an argument is typed; a service that does not answer at once has nothing to offer."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import httpx2

from gaplab.api.clients.client import Client, ServiceError, ServiceUnreachable
from gaplab.schemas.records import ExperimentRead, StudyRead

PATIENCE_S = 1.5
"""A shell that waits longer for an offer seems to hang."""

MOST = 50
KINDS = ("strategies", "robots", "engines", "tunables", "optimizers")


class _Hasty(Client):
    """A client that asks once: who presses a key again asks again."""

    def _patiently(self, method: str, path: str, **request: Any) -> httpx2.Response:  # noqa: ANN401 - as the client's
        return self._request(method, path, **request)


def ids(incomplete: str) -> list[tuple[str, str]]:
    """The newest studies and experiments, each with its name and state."""
    return _offered(lambda client: _newest(client, incomplete))


def experiments(incomplete: str) -> list[tuple[str, str]]:
    """The newest experiments, each with its name and state."""
    return _offered(lambda client: _named(client.experiments(limit=MOST).items, incomplete))


def kinds(incomplete: str) -> list[str]:
    """The kinds of plug-ins."""
    return [each for each in KINDS if each.startswith(incomplete)]


def plugins(incomplete: str) -> list[tuple[str, str]]:
    """Every plug-in by its name, with what it is."""

    def found(client: Client) -> Iterator[tuple[str, str]]:
        catalogue = client.catalogue()
        for kind in KINDS:
            for each in getattr(catalogue, kind):
                if each.name.startswith(incomplete):
                    yield each.name, each.summary

    return _offered(found)


def _newest(client: Client, incomplete: str) -> Iterator[tuple[str, str]]:
    yield from _named(client.studies(limit=MOST).items, incomplete)
    yield from _named(client.experiments(limit=MOST).items, incomplete)


def _named(found: Iterable[ExperimentRead | StudyRead], incomplete: str) -> Iterator[tuple[str, str]]:
    for each in found:
        if each.id.startswith(incomplete):
            yield each.id, f"{each.name} ({each.state})"


def _offered(of: Callable[[Client], Iterator[tuple[str, str]]]) -> list[tuple[str, str]]:
    try:
        with _Hasty(timeout_s=PATIENCE_S) as client:
            return list(of(client))
    except (ServiceError, ServiceUnreachable, ValueError):
        return []


def figures(incomplete: str) -> list[str]:
    """The kinds of figures, as the service documents them."""

    def found(client: Client) -> Iterator[tuple[str, str]]:
        for kind in client.figure_kinds():
            if kind.startswith(incomplete):
                yield kind, ""

    return [kind for kind, _ in _offered(found)]
