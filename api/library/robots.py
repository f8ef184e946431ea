"""Robots by name, from files and of specs, in this process."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from pydantic import ValidationError

from gaplab.schemas.mistakes import permitted_by, pointer_to, sentence, within
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import ExperimentSpec, PoolRef, SharedSettings, StudySpec
from gaplab.services.core.errors import InvalidRobot, InvalidSpec, Violation, unknown_name
from gaplab.services.experiments import stored_files
from gaplab.services.plugins import folders
from gaplab.services.specs.robots import Driven, ref_of_file, robot_of, robot_of_file
from gaplab.services.store.session import Store
from gaplab.services.world.robot_files import RobotFile
from gaplab.services.world.robot_library import IMPORTED, robot_file
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot

S = TypeVar("S", bound=SharedSettings)
T = TypeVar("T", ExperimentSpec, StudySpec)

AnyRobot: TypeAlias = str | Path | Mapping[str, Any] | SharedSettings
"""A robot's name; its robot file, URDF or MJCF, which is imported as by `gaplab robot import`; or a spec."""

SIMULATED = ("robot", "controller", "task", "engine")
"""Fields that are read of a spec."""

Named: TypeAlias = str | Mapping[str, Any] | PluginRef | None
"""A plug-in by its name, or as an object with its options; None: that of the spec, or the robot's."""


def read_robot(robot: AnyRobot, *, controller: Named = None, task: Named = None) -> Robot:
    """Return a robot by its name, of a robot file, URDF or MJCF, or of a spec.

    Its `rated` computes fitness and readings from recorded angles of joints.

    Raises:
        InvalidSpec: robot, controller or task is unknown or refused, or the file cannot be imported.
        EngineUnavailable: MuJoCo, which imports URDF and MJCF, is not installed.
        OSError: the file cannot be read.
        TypeError: it is neither a name, a file nor a spec.
    """
    asked = settings(SharedSettings, robot, controller=controller, task=task)
    return robot_of(Driven(asked.robot, asked.controller, asked.task))


def settings(kind: type[S], robot: AnyRobot, **others: Any) -> S:  # noqa: ANN401 - as in a spec
    """Return what a robot, or a spec, says about what is simulated; others that are not None replace it.

    Other fields of an experiment are arguments: an object with some is refused; of a complete spec, they are not read.
    Errors are those of `read_robot`.
    """
    folders.load()
    spec = {"robot": robot} if isinstance(robot, str | Path) else robot
    if not isinstance(spec, Mapping | SharedSettings):
        raise TypeError(f"a robot is its name, its file or a spec, not {robot!r:.100}")
    said = {name: each for name, each in dict(spec).items() if name in SIMULATED}
    if issubclass(kind, ExperimentSpec) and isinstance(spec, Mapping) and (ignored := spec.keys() - said.keys()):
        message = f"of a spec, {', '.join(SIMULATED)} are read here; give the others as arguments"
        raise InvalidSpec(Violation(f"/{each}", spec[each], message, SIMULATED) for each in sorted(ignored))
    if isinstance(named := said.get("robot"), str | Path):
        said["robot"] = _of_file(Path(named)) if Path(named).suffix else _of_name(str(named))
    said |= {name: each for name, each in others.items() if each is not None}
    try:
        return kind.model_validate(said)
    except ValidationError as error:
        raise invalid(error, said) from error


def invalid(error: ValidationError, body: object) -> InvalidSpec:
    """Return an error of a schema about a body in the words of the service."""
    found: Iterable[dict[str, Any]] = map(dict, error.errors())
    placed = ((each, within(body, each["loc"])) for each in found)
    return InvalidSpec(
        Violation(pointer_to(place), each["input"], sentence(each, place), permitted_by(each)) for each, place in placed
    )


def _of_name(name: str) -> PluginRef:
    if name in robots or name in robots.unusable:
        return PluginRef(name=name)
    found = unknown_name("/robot", "robot", name, [each for each in robots if each != IMPORTED])
    message = f"{found.message}, and files like '{name}.json'; a service's own robots are known to the service alone"
    raise InvalidSpec([Violation("/robot", name, message, found.permitted, found.nearest)])


def _of_file(path: Path) -> PluginRef:
    """Return how specs name the robot of a file, which this process then knows."""
    from gaplab.services.robots.importing import import_robot
    from gaplab.services.robots.options import ImportOptions

    try:
        is_robot_file = path.suffix == ".json"
        file = RobotFile.read(path.read_bytes()) if is_robot_file else import_robot(path, ImportOptions()).robot
    except InvalidRobot as error:
        raise InvalidSpec(Violation("/robot", str(path), reason) for reason in error.reasons) from error
    robot_of_file(file)
    return ref_of_file(file.sha256, file.name)


def with_files(store: Store, spec: T) -> T:
    """Return a spec whose robot and pool may be files: the store then has them, and the spec their hashes.

    Raises:
        InvalidSpec: a file cannot be used.
        OSError: it cannot be read.
    """
    found: dict[str, Any] = {}
    if Path(spec.robot.name).suffix:
        found["robot"] = _of_file(Path(spec.robot.name))
    if (file := robot_file(str((found.get("robot") or spec.robot).options.get("sha256", "")))) is not None:
        stored_files.ROBOTS.add(store, file.text)
    if spec.reality.pool is not None and Path(spec.reality.pool.name).suffix:
        read = stored_files.POOLS.add(store, Path(spec.reality.pool.name).read_bytes())
        found["reality"] = spec.reality.model_copy(update={"pool": PoolRef(name=read.name, sha256=read.sha256)})
    return spec.model_copy(update=found)
