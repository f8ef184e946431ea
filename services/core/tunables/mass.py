"""Mass of bodies."""

from dataclasses import replace

from gaplab.services.core.tunables.groups import BodyTunable, Limits, ScaleOptions
from gaplab.services.core.world import Body, Inertia, World


class Mass(BodyTunable):
    """Mass of bodies, as in `mass(trunk)`; a stated inertia grows with it, for shape and distribution stay."""

    name = "mass"
    field = "body.mass_kg"
    also = frozenset({"moments_kg_m2"})
    value_unit = "kg"
    Options = ScaleOptions
    scale = Limits(0.7, 1.3, 0.01, 100.0)
    value = Limits(0.1, 10.0, 1e-6, 1e6)
    from_the_mean = True

    def number(self, member: Body) -> float:
        """Return the mass of a body."""
        return member.mass_kg

    def with_number(self, member: Body, number: float) -> Body:
        """Return a body of another mass."""
        if member.inertia is None or not member.mass_kg:
            return replace(member, mass_kg=number)
        if number == member.mass_kg:
            return member  # moments, multiplied and divided, could differ by a rounding
        x, y, z = (moment * number / member.mass_kg for moment in member.inertia.moments_kg_m2)
        return replace(member, mass_kg=number, inertia=Inertia((x, y, z), member.inertia.turn))

    def _in_world(self, world: World, members: tuple[Body, ...]) -> World:
        edited = super()._in_world(world, members)
        stated = any(body.inertia is not None for body in self._group(world))
        return edited.edited("body.inertia") if stated else edited
