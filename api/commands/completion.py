"""Shell completion of arguments; if the service does not answer at once, there is none."""

from collections.abc import Callable, Iterable, Iterator, Sequence

from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable
from gaplab.schemas.records import ExperimentRead, StudyRead

PATIENCE_S = 1.5
"""Longest wait for an answer; a shell that waits longer seems to hang."""

MOST = 50
KINDS = ("strategies", "robots", "controllers", "tasks", "engines", "tunables", "optimizers", "discrepancies", "tuners")


def ids(incomplete: str) -> list[tuple[str, str]]:
    """Return the newest studies and their experiments, each with its name and state."""
    return _completions(incomplete, lambda client: [*_named(_newest(client)), *_experiments(client)])


def experiments(incomplete: str) -> list[tuple[str, str]]:
    """Return the experiments of the newest studies, each with its name and state."""
    return _completions(incomplete, _experiments)


def plugins(incomplete: str) -> list[tuple[str, str]]:
    """Return the plug-ins, each with its summary."""
    return _completions(incomplete, _plugins)


def figures(incomplete: str) -> list[str]:
    """Return the kinds of figures."""
    kinds = _completions(incomplete, lambda client: [(kind, "") for kind in client.figure_kinds()])
    return [kind for kind, _ in kinds]


def _completions(incomplete: str, candidates: Callable[[Client], Iterable[tuple[str, str]]]) -> list[tuple[str, str]]:
    try:
        with Client(timeout_s=PATIENCE_S, pauses_s=()) as client:
            return [(name, summary) for name, summary in candidates(client) if name.startswith(incomplete)]
    except (ServiceError, ServiceUnreachable, ValueError):
        return []


def _newest(client: Client) -> Sequence[StudyRead]:
    return client.studies(limit=MOST).items


def _experiments(client: Client) -> list[tuple[str, str]]:
    return _named([each for study in _newest(client) for each in study.experiments])


def _named(records: Sequence[ExperimentRead | StudyRead]) -> list[tuple[str, str]]:
    return [(record.id, f"{record.name} ({record.state})") for record in records]


def _plugins(client: Client) -> Iterator[tuple[str, str]]:
    catalogue = client.catalogue()
    return ((plugin.name, plugin.summary) for kind in KINDS for plugin in getattr(catalogue, kind))
