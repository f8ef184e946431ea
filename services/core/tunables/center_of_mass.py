"""Centre of mass of bodies."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.inertias import inertia_of
from gaplab.services.core.tunables.base import SHARES, Tunable, lacking, matching
from gaplab.services.core.tunables.groups import ALL, Pattern
from gaplab.services.core.world import Body, World


class CenterOptions(Frozen):
    """Options of `center_of_mass`."""

    of: Pattern = Field(default="*", description=ALL)
    along: Literal["x", "y", "z"] = Field(default="x", description="axis of the body's frame")


class CenterOfMass(Tunable):
    """Shift of the centre of mass of bodies along an axis of their frame; shape and inertia about the centre stay."""

    name = "center_of_mass"
    field = "body.center_m"
    also = frozenset({"shape", "inertia"})
    unit = "m"
    lower, upper = -0.05, 0.05
    least, greatest = -10.0, 10.0
    relative = True
    order = SHARES
    Options = CenterOptions
    options: CenterOptions

    def read(self, world: World) -> float:  # noqa: ARG002 - a shift is from what is there
        """Return 0."""
        return 0.0

    def edit(self, world: World, value: float) -> World:
        """Return the world with shifted centres of mass."""
        if not value:
            return world
        chosen = matching(self.options.of, [body.name for body in world.bodies])
        axis = "xyz".index(self.options.along)

        def shifted(body: Body) -> Body:
            if body.name not in chosen:
                return body
            place = list(body.center_m)
            place[axis] += float(value)
            return replace(body, center_m=(place[0], place[1], place[2]))

        parted = _parted(world, chosen)
        return parted.edited(self.field, bodies=tuple(map(shifted, parted.bodies)))

    def lack(self, world: World) -> tuple[str, tuple[str, ...]] | None:
        """Return that the robot has no such body."""
        return lacking("body", self.options.of, [body.name for body in world.bodies])


def _parted(world: World, chosen: tuple[str, ...]) -> World:
    """Return the world in which the shapes of bodies do not move with their centres of mass.

    All shifts share it, so that engines build it once.
    """
    if all(isinstance(body.shape, tuple) for body in world.bodies if body.name in chosen):
        return world
    bodies = tuple(
        replace(body, shape=body.parts, inertia=inertia_of(body)) if body.name in chosen else body
        for body in world.bodies
    )
    return replace(world, bodies=bodies, origin=None, edits=frozenset())
