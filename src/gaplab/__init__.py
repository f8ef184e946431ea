"""The Python API of gaplab, for programs and notebooks.

from gaplab import Client

with Client() as gaplab:
    study = gaplab.submit({"robot": "toy_function", "budget": "smoke"})
    study.wait()
    study.figure().save("curves.pdf")

Your own plug-ins import from `gaplab.plugins`. The other modules are internal.
"""

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from gaplab.arithmetic import fix_arithmetic

fix_arithmetic()

if TYPE_CHECKING:
    __version__: str

    from gaplab.api.clients.client import Client as Client
    from gaplab.api.clients.confirmation import NotSubmitted as NotSubmitted
    from gaplab.api.clients.drivers import MeasurementFailed as MeasurementFailed
    from gaplab.api.clients.driving import DriverMotion as DriverMotion
    from gaplab.api.clients.errors import ExperimentFailed as ExperimentFailed
    from gaplab.api.clients.errors import ExtraMissing as ExtraMissing
    from gaplab.api.clients.errors import ServiceError as ServiceError
    from gaplab.api.clients.errors import ServiceUnreachable as ServiceUnreachable
    from gaplab.api.clients.figures import Figure as Figure
    from gaplab.api.clients.objects import Experiment as Experiment
    from gaplab.api.clients.objects import Study as Study
    from gaplab.api.clients.results import Comparisons as Comparisons
    from gaplab.api.library.pools import PoolOptions as PoolOptions
    from gaplab.api.library.pools import import_pool as import_pool
    from gaplab.api.library.recovering import recover as recover
    from gaplab.api.library.robots import read_robot as read_robot
    from gaplab.api.library.running import Interrupted as Interrupted
    from gaplab.api.library.running import Result as Result
    from gaplab.api.library.running import run as run
    from gaplab.api.library.simulating import simulate as simulate
    from gaplab.api.library.tuning import Tuning as Tuning
    from gaplab.api.process.errors import CommandError as CommandError
    from gaplab.api.process.local_service import local_service as local_service
    from gaplab.samples import read_samples as read_samples
    from gaplab.schemas.samples import InvalidSamples as InvalidSamples
    from gaplab.services.core.errors import InvalidSpec as InvalidSpec

_MODULES = {
    "Client": "gaplab.api.clients.client",
    "CommandError": "gaplab.api.process.errors",
    "Comparisons": "gaplab.api.clients.results",
    "DriverMotion": "gaplab.api.clients.driving",
    "Experiment": "gaplab.api.clients.objects",
    "ExperimentFailed": "gaplab.api.clients.errors",
    "ExtraMissing": "gaplab.api.clients.errors",
    "Figure": "gaplab.api.clients.figures",
    "Interrupted": "gaplab.api.library.running",
    "InvalidSamples": "gaplab.schemas.samples",
    "InvalidSpec": "gaplab.services.core.errors",
    "MeasurementFailed": "gaplab.api.clients.drivers",
    "NotSubmitted": "gaplab.api.clients.confirmation",
    "PoolOptions": "gaplab.api.library.pools",
    "Result": "gaplab.api.library.running",
    "ServiceError": "gaplab.api.clients.errors",
    "ServiceUnreachable": "gaplab.api.clients.errors",
    "Study": "gaplab.api.clients.objects",
    "Tuning": "gaplab.api.library.tuning",
    "import_pool": "gaplab.api.library.pools",
    "local_service": "gaplab.api.process.local_service",
    "read_robot": "gaplab.api.library.robots",
    "read_samples": "gaplab.samples",
    "recover": "gaplab.api.library.recovering",
    "run": "gaplab.api.library.running",
    "simulate": "gaplab.api.library.simulating",
}

__all__ = sorted(_MODULES)


def __getattr__(name: str) -> Any:  # noqa: ANN401 - a class or a function
    """Import a name when it is first used: a worker that loads a plug-in needs no client."""
    if name == "__version__":
        return version("gaplab")
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__", "plugins"]
