"""Specs for another process, with the robot files that it needs."""

from typing import NamedTuple

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.plugins.external import named_files
from gaplab.services.world import robot_library


class SentSpec(NamedTuple):
    """A resolved spec for a process that has no store.

    Attributes:
        text: the spec, as JSON.
        robots: texts of robot files.
        plugins: files of each external plug-in that it names, with their hashes, by kind and name.
    """

    text: str
    robots: tuple[str, ...]
    plugins: dict[str, str]


def sent(spec: ResolvedSpec) -> SentSpec:
    """Return a spec to be sent."""
    plugins = named_files(spec.model_dump(mode="json"))
    return SentSpec(spec.model_dump_json(), robot_library.needed_by(spec.robot), plugins)


def received(spec: SentSpec) -> ResolvedSpec:
    """Return the spec that was sent, in a process that has imported its plug-ins and no others."""
    robot_library.learn(spec.robots)
    return ResolvedSpec.model_validate_json(spec.text)
