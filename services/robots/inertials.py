"""Changed masses, centres and inertias of a World's body, as those of the file's bodies that it consists of."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.world import Body, Inertia
from gaplab.services.robots.bodies import Bodies
from gaplab.services.robots.changes import same
from gaplab.services.robots.geometry import rotation_of
from gaplab.services.robots.reading import body_name


@dataclass(frozen=True)
class Inertial:
    """The new inertial of one body of a file.

    Attributes:
        body: its name.
        number: its number in MuJoCo's model.
        scale: factor of its mass, and of its inertia about its centre.
        moved_m: `(3,)`: shift of its centre of mass, in its frame.
        center_m: `(3,)`: its new centre of mass, in its frame.
        mass_kg: its new mass.
        moments_kg_m2: `(3,)`: its new principal moments.
        axes: rotation of the principal axes in its frame.
    """

    body: str
    number: int
    scale: float
    moved_m: FloatArray
    center_m: FloatArray
    mass_kg: float
    moments_kg_m2: FloatArray
    axes: Rotation

    @property
    def tensor(self) -> FloatArray:
        """Return `(3, 3)`: the inertia about the centre of mass, in the body's frame."""
        turn = self.axes.as_matrix()
        return np.asarray(turn @ np.diag(self.moments_kg_m2) @ turn.T)


def inertials(bodies: Bodies, head: int, before: Body, after: Body) -> list[Inertial] | None:
    """Return the inertials of the members of a body; None if several members cannot share its change.

    Masses of members change by the same factor, and their centres by the same shift. An inertia that changes by another
    factor than the mass is possible for a single member alone.

    Args:
        bodies: bodies of the file.
        head: number of the body.
        before: the body as imported.
        after: the changed body.
    """
    scale = after.mass_kg / before.mass_kg
    shared = [number for number in bodies.members(head) if bodies.model.body_mass[number] > 0]
    assert before.inertia is not None
    assert after.inertia is not None
    x, y, z = (scale * moment for moment in before.inertia.moments_kg_m2)
    is_scaled = same(Inertia((x, y, z), before.inertia.turn), after.inertia)
    if not is_scaled and len(shared) > 1:
        return None
    moved = np.array(after.center_m) - np.array(before.center_m)
    found = list(_of_members(bodies, head, shared, scale, moved))
    if is_scaled:
        return found
    ((only,), turn) = found, bodies.turn(shared[0], head)
    axes = turn.inv() * Rotation.from_quat(after.inertia.turn)
    return [replace(only, scale=float("nan"), moments_kg_m2=np.array(after.inertia.moments_kg_m2), axes=axes)]


def _of_members(bodies: Bodies, head: int, members: list[int], scale: float, moved_m: FloatArray) -> Iterator[Inertial]:
    model = bodies.model
    for number in members:
        shift = np.asarray(bodies.turn(number, head).inv().apply(moved_m))
        yield Inertial(
            body=body_name(model, number),
            number=number,
            scale=scale,
            moved_m=shift,
            center_m=model.body_ipos[number] + shift,
            mass_kg=float(model.body_mass[number]) * scale,
            moments_kg_m2=model.body_inertia[number] * scale,
            axes=rotation_of(model.body_iquat[number]),
        )
