"""What programs and notebooks import.

from gaplab import Client

with Client() as gaplab:
    study = gaplab.submit({"robot": "toy_function", "budget": "smoke"})
    gaplab.wait(study.id)
    gaplab.figure(study.id).save("curves.pdf")

Plug-ins of one's own import from `gaplab.plugins`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from api.client import Client as Client
    from api.client import ExperimentFailed as ExperimentFailed
    from api.client import ExtraMissing as ExtraMissing
    from api.client import ServiceError as ServiceError
    from api.client import ServiceUnreachable as ServiceUnreachable
    from api.clients.figures import Figure as Figure
    from api.exits import CommandError as CommandError
    from api.own import local_service as local_service

_HOMES = {
    "Client": "api.client",
    "CommandError": "api.exits",
    "ExperimentFailed": "api.client",
    "ExtraMissing": "api.client",
    "Figure": "api.clients.figures",
    "ServiceError": "api.client",
    "ServiceUnreachable": "api.client",
    "local_service": "api.own",
}

__all__ = [
    "Client",
    "CommandError",
    "ExperimentFailed",
    "ExtraMissing",
    "Figure",
    "ServiceError",
    "ServiceUnreachable",
    "local_service",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever it is
    """What is asked for, imported only now: a worker that loads a plug-in needs no client."""
    if name not in _HOMES:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "plugins"]
