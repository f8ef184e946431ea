"""Specs for another process, with the robot files that it needs."""

from typing import NamedTuple

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core import robot_library
from gaplab.services.plugins.watching import imported


class SentSpec(NamedTuple):
    """A resolved spec for a process that has no store.

    Attributes:
        text: the spec, as JSON.
        robots: texts of robot files.
    """

    text: str
    robots: tuple[str, ...]


def sent(spec: ResolvedSpec) -> SentSpec:
    """Return a spec to be sent."""
    return SentSpec(spec.model_dump_json(), robot_library.needed_by(spec.robot))


def received(spec: SentSpec) -> ResolvedSpec:
    """Return the spec that was sent, in a process that has the plug-ins as their files are now."""
    imported.renewed()
    robot_library.learn(spec.robots)
    return ResolvedSpec.model_validate_json(spec.text)
