"""Tunables of a spec: the robot's usual ones where it names none, and their bounds."""

from collections.abc import Iterable
from typing import Any

from gaplab.schemas.plugin import TunableRef
from gaplab.schemas.resolved import ResolvedTunable
from gaplab.schemas.spec import ExperimentSpec, SharedSettings
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.tunables.base import Tunable
from gaplab.services.core.tunables.labels import label_of, tunable_of
from gaplab.services.engines.base import Engine


def with_usual_tunables(spec: ExperimentSpec, robot: Robot) -> ExperimentSpec:
    """Return the spec with the robot's usual tunables, if it names none and the robot has some."""
    if "tunables" in spec.model_fields_set or not robot.usual_tunables:
        return spec
    return spec.model_copy(update={"tunables": tuple(TunableRef(name=label) for label in robot.usual_tunables)})


def shared_fields(spec: SharedSettings, names: Iterable[str]) -> dict[str, Any]:
    """Return fields of a study's spec, or of a check's, for an experiment; tunables that it leaves out stay so."""
    left_out = set() if "tunables" in spec.model_fields_set else {"tunables"}
    return {name: getattr(spec, name) for name in names if name not in left_out}


def with_bounds(ref: TunableRef, robot: Robot) -> ResolvedTunable:
    """Return a tunable by its proper label, with its bounds."""
    tunable = tunable_of(ref.name)
    lower, upper = bounds_of(ref, tunable, robot)
    return ResolvedTunable(name=label_of(tunable), lower=lower, upper=upper)


def bounds_of(ref: TunableRef, tunable: Tunable, robot: Robot) -> tuple[float, float]:
    """Return the bounds of a tunable; a missing one is the tunable's own for the robot."""
    lower, upper = tunable.bounds(robot.world)
    return lower if ref.lower is None else ref.lower, upper if ref.upper is None else ref.upper


def honoured(tunable: Tunable, engine: type[Engine]) -> bool:
    """Return whether a tunable changes what an engine simulates; noise is put into motions, so each engine has it."""
    return tunable.field == "noise" or tunable.field in engine.honours
