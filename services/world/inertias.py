"""Inertia of bodies, and of whole robots as their joints feel it."""

from functools import lru_cache

import numpy as np
import scipy

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.kinematics import body_poses, chain, product, rotated
from gaplab.services.world.world import UNTURNED, Body, Box, Capsule, Cylinder, Hull, Inertia, Shape, World

WORLDS_KEPT = 1024


def inertia_of(body: Body) -> Inertia:
    """Return the inertia of a body about its centre of mass: the given one, or that of its solid shape."""
    if body.inertia is not None:
        return body.inertia
    assert not isinstance(body.shape, tuple)
    if isinstance(body.shape, Hull):
        return _of_hull(body.mass_kg, np.array(body.shape.points_m))
    x, y, z = (body.mass_kg * moment for moment in _moments_by_mass(body.shape))
    return Inertia((x, y, z))


def _moments_by_mass(shape: Shape) -> tuple[float, float, float]:
    """Return the principal moments of a solid of 1 kg."""
    match shape:
        case Box(size_m=(x, y, z)):
            return (y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12
        case Cylinder(radius_m=radius, length_m=length):
            across = (3 * radius**2 + length**2) / 12
            return across, across, radius**2 / 2
        case Capsule(radius_m=radius, length_m=length):
            rod, balls = length / (length + 4 / 3 * radius), 4 / 3 * radius / (length + 4 / 3 * radius)
            end = 2 / 5 * radius**2 + length**2 / 4 + 3 / 8 * radius * length  # of both half balls, about the middle
            across = rod * (3 * radius**2 + length**2) / 12 + balls * end
            return across, across, (rod / 2 + balls * 2 / 5) * radius**2
        case _:
            assert not isinstance(shape, Hull)
            return (2 / 5 * shape.radius_m**2,) * 3


def _of_hull(mass_kg: float, points: FloatArray) -> Inertia:
    """Return the inertia of a solid hull about its centroid: the sum over tetrahedra from there to its faces."""
    inner = points.mean(axis=0)
    hull = scipy.spatial.ConvexHull(points)
    corners = points[hull.simplices] - inner
    volumes = np.abs(np.linalg.det(corners)) / 6
    sums = corners.sum(axis=1)
    centroid = (volumes[:, None] * sums).sum(axis=0) / 4 / volumes.sum()
    second = np.einsum("f,fi,fj->ij", volumes, sums, sums) + np.einsum("f,fvi,fvj->ij", volumes, corners, corners)
    spread = second / 20 / volumes.sum() - np.outer(centroid, centroid)
    moments, axes = np.linalg.eigh(np.trace(spread) * np.eye(3) - spread)  # of 1 kg: a mass must not turn them
    x, y, z = (mass_kg * moments).tolist()
    return Inertia((x, y, z), _turn_of(axes))


def _turn_of(axes: FloatArray) -> tuple[float, float, float, float]:
    """Return the rotation whose axes are the columns `(3, 3)`, one of them reversed if they are left-handed."""
    axes = axes * np.array([1.0, 1.0, np.sign(np.linalg.det(axes))])
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = axes.tolist()
    outer = np.array(
        [
            [xx - yy - zz, yx + xy, zx + xz, zy - yz],
            [0.0, yy - xx - zz, zy + yz, xz - zx],
            [0.0, 0.0, zz - xx - yy, yx - xy],
            [0.0, 0.0, 0.0, xx + yy + zz],
        ]
    )
    symmetric = outer + np.triu(outer, 1).T
    x, y, z, w = np.linalg.eigh(symmetric)[1][:, -1].tolist()  # Bar-Itzhack 2000: the dominant eigenvector
    return (x, y, z, w)


@lru_cache(maxsize=WORLDS_KEPT)
def inverse_inertias(world: World) -> FloatArray:
    """Return `(joints,)`: the acceleration of each joint by a torque in it, at the start, in rad/s² by N·m.

    All other joints, and the base if it is not fixed, are free. It is the diagonal of the inverse of the inertia
    matrix, with armatures.
    """
    count = 0 if world.fixed else 6
    inverse = np.linalg.pinv(_inertia_matrix(world)[6 - count :, 6 - count :])
    return frozen(np.diag(inverse)[count:])


def _inertia_matrix(world: World) -> FloatArray:
    """Return `(6 + joints, 6 + joints)`: base's speed, its angular velocity, and joint speeds; at the start."""
    start = np.array([[0.0, 0.0, 0.0, *world.start_turn]])
    positions, turns = (each[0] for each in body_poses(world, start, np.array([[each.start for each in world.joints]])))
    places = {body.name: place for place, body in enumerate(world.bodies)}
    total = np.diag([0.0] * 6 + [joint.armature for joint in world.joints])
    for place, body in enumerate(world.bodies):
        center = positions[place] + rotated(turns[place], np.array(body.center_m))
        moving, turning = np.zeros((3, len(total))), np.zeros((3, len(total)))
        moving[:, :3] = turning[:, 3:6] = np.eye(3)
        moving[:, 3:6] = np.cross(np.eye(3), center - positions[0]).T
        for number in chain(world, body.name):
            joint = world.joints[number]
            child = places[joint.child]
            axis = rotated(turns[child], np.array(joint.axis))
            if joint.slides:
                moving[:, 6 + number] = axis
            else:
                turning[:, 6 + number] = axis
                moving[:, 6 + number] = np.cross(axis, center - positions[child])
        inertia = inertia_of(body)
        frame = turns[place] if inertia.turn == UNTURNED else product(turns[place], np.array(inertia.turn))
        axes = rotated(frame, np.eye(3)).T
        about = turning.T @ axes * np.array(inertia.moments_kg_m2) @ axes.T @ turning
        total = total + body.mass_kg * moving.T @ moving + about
    return total
