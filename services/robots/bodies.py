"""Bodies, shapes and joints of a World from a compiled model: bodies that are fixed to each other become one."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.reading import Handle, Source, body_name, mujoco_library
from gaplab.services.world.world import (
    Body,
    Box,
    Capsule,
    Cylinder,
    Hull,
    Inertia,
    Joint,
    Part,
    Quaternion,
    Shape,
    Sphere,
    Vector,
)

EXACT = 1e-5
"""Share of a hull's size within which it is exact: more vertices would not be seen."""

DIRECTIONS = np.array([each for each in product((-1, 0, 1), repeat=3) if sum(map(abs, each)) in {1, 3}], dtype=float)
"""`(14, 3)`: towards the faces and the corners of a cube; the farthest points in them are the first vertices."""


def simplify(points_m: FloatArray, most: int) -> tuple[FloatArray, float]:
    """Return `(k, 3)`, k ≤ `most`: some of the points `(n, 3)`, and the share of volume that their hull lacks.

    The points that are farthest outside are added one by one, so that the result lies inside, and does not depend on
    chance.

    Raises:
        QhullError: the points lie in a plane.
    """
    whole = ConvexHull(points_m)
    corners = points_m[np.sort(whole.vertices)]
    if len(corners) <= most:
        return corners, 0.0
    size = float(np.ptp(corners, axis=0).max())
    chosen = list(dict.fromkeys(int(np.argmax(corners @ direction)) for direction in DIRECTIONS))[:most]
    hull = ConvexHull(corners[chosen])
    while len(chosen) < most:
        outside = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        farthest = int(np.argmax(outside))
        if outside[farthest] < EXACT * size:
            break
        chosen.append(farthest)
        hull = ConvexHull(corners[chosen])
    return corners[sorted(chosen)], float(1 - hull.volume / whole.volume)


DIGITS = 7
"""Decimals of a hull's vertices, m: finer than their single precision."""


def vector(values: FloatArray) -> Vector:
    """Return three numbers; adding 0 makes -0 to 0."""
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z


def quaternion(turn: Rotation) -> Quaternion:
    """Return a rotation as x, y, z, w with w ≥ 0."""
    x, y, z, w = (float(value) + 0.0 for value in turn.as_quat(canonical=True))
    return x, y, z, w


def rotation_of(wxyz: FloatArray) -> Rotation:
    """Return the rotation of MuJoCo's quaternion w, x, y, z."""
    return Rotation.from_quat(np.roll(wxyz, -1))


def tensor(moments_kg_m2: FloatArray | Vector, axes: Rotation) -> FloatArray:
    """Return `(3, 3)`: an inertia in the frame that its axes are in; equal moments have no axes of their own."""
    turn = axes.as_matrix()
    return np.asarray(turn @ np.diag(moments_kg_m2) @ turn.T)


class Shapes:
    """Shapes of the geoms of a model; the hull of a mesh is computed once, and `planes` are the file's ground."""

    def __init__(self, source: Source) -> None:
        model = self._model = source.model
        self._options, self._notes = source.options, source.notes
        self._hull = cache(self._simplified)
        self.planes = [at for at in range(model.ngeom) if model.geom_bodyid[at] == 0 and self._kind(at) == "plane"]
        self._grounds = [(int(model.geom_contype[at]), int(model.geom_conaffinity[at])) for at in self.planes]

    def collides(self, geom: int) -> bool:
        """Return whether a geom collides with the file's ground, or with anything, if the file has no ground."""
        kind, with_kinds = int(self._model.geom_contype[geom]), int(self._model.geom_conaffinity[geom])
        if not self._grounds:
            return bool(kind or with_kinds)
        return any(kind & ground[1] or with_kinds & ground[0] for ground in self._grounds)

    def on_the_ground(self, geom: int) -> float:
        """Return the coefficient of MuJoCo's contact of a geom with the file's ground, its own if there is none."""
        model = self._model
        able = [geom, *self.planes]
        highest = max(int(model.geom_priority[at]) for at in able)
        leading = [at for at in able if int(model.geom_priority[at]) == highest]
        if max(int(model.geom_condim[at]) for at in leading) == 1:
            return 0.0
        return max(float(model.geom_friction[at, 0]) for at in leading)

    def part(self, geom: int, center: FloatArray, turn: Rotation) -> Part | None:
        """Return the part of a geom, given its place `(3,)` and turn in the World's body; None if a World lacks it."""
        shape = self._shape(geom)
        if shape is None:
            return None
        return Part(shape, vector(center), quaternion(turn), collides=self.collides(geom))

    def _shape(self, geom: int) -> Shape | None:
        x, y, z = (float(value) for value in self._model.geom_size[geom])
        kind = self._kind(geom)
        if kind == "box":
            return Box((2 * x, 2 * y, 2 * z))
        if kind == "sphere":
            return Sphere(x)
        if kind in {"capsule", "cylinder"}:
            return (Capsule if kind == "capsule" else Cylinder)(x, 2 * y)
        if kind == "mesh":
            return self._hull(int(self._model.geom_dataid[geom]))
        if kind == "ellipsoid":
            self._notes.lose(
                f"{self._name(geom)} is an ellipsoid: it becomes a hull of {self._options.vertices} points"
            )
            return _ellipsoid(np.array([x, y, z]), self._options.vertices)
        self._notes.lose(f"{self._name(geom)} is a {kind}, which a robot cannot have: it is left out")
        return None

    def _simplified(self, mesh: int) -> Hull | None:
        model = self._model
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        name = str(model.mesh(mesh).name) or f"mesh{mesh}"
        try:
            points, lacking = simplify(model.mesh_vert[first : first + count].astype(float), self._options.vertices)
        except QhullError:
            self._notes.lose(f"mesh {name} is flat: it is left out")
            return None
        change = f", {100 * lacking:.2g} % smaller than its convex hull" if lacking else ""
        self._notes.lose(f"mesh {name} of {count} vertices becomes a hull of {len(points)}{change}")
        return Hull(tuple(vector(np.round(point, DIGITS)) for point in points))

    def _kind(self, geom: int) -> str:
        kinds = ("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf")
        return kinds[int(self._model.geom_type[geom])]

    def _name(self, geom: int) -> str:
        return str(self._model.geom(geom).name) or f"geom{geom}"


def _ellipsoid(radii: FloatArray, count: int) -> Hull:
    """Return the hull of points that are spread evenly over an ellipsoid, along a spiral."""
    at = np.arange(count) + 0.5
    height, around = 1 - 2 * at / count, np.pi * (1 + np.sqrt(5)) * at
    across = np.sqrt(1 - height * height)
    points = np.stack([across * np.cos(around), across * np.sin(around), height], axis=1) * radii
    return Hull(tuple(vector(np.round(point, DIGITS)) for point in points))


FREE, BALL, SLIDE, HINGE = 0, 1, 2, 3
"""MuJoCo's types of joints."""

HELD_KG = 1.0
"""Mass of the base that is made for a robot on a rail or a hinge of the world; it never moves."""


@dataclass(frozen=True)
class Frame:
    """The frame of a World's body at the model's reference angles, in the scene.

    Attributes:
        zero: its rotation with its joint at zero.
        back_m: `(3,)`: what leads from `place_m` to the place with its joint at zero.
    """

    place_m: FloatArray
    turn: Rotation
    zero: Rotation
    back_m: FloatArray


class Bodies:
    """The bodies of a model as those of a World.

    Attributes:
        heads: numbers of the bodies that are the World's, the base first; 0 stands for a base that never moves.
        frames: frame of each head.
    """

    def __init__(self, source: Source) -> None:
        mujoco, self.model = mujoco_library(), source.model
        self._options, self._notes = source.options, source.notes
        self._data = mujoco.MjData(self.model)
        self._data.qpos[:] = self.model.qpos0
        mujoco.mj_kinematics(self.model, self._data)
        weld = self.model.body_weldid
        self.heads = [at for at in range(self.model.nbody) if weld[at] == at and (at > 0 or self.is_held)]
        self.frames = {head: self._frame(head) for head in self.heads}
        self._shapes = Shapes(source)
        for head in self.heads:
            if others := [at for at in self.members(head) if at != head]:
                names = [body_name(self.model, at) for at in others]
                self._notes.lose(f"fixed to {self.name(head)}, and part of it: {{}}", *names)

    @property
    def is_held(self) -> bool:
        """Whether the base is fixed to the world, since the first joint is not free."""
        return bool(self.model.jnt_type[0] != FREE)

    def name(self, head: int) -> str:
        """Return the name of a body of the World."""
        return body_name(self.model, head) if head else "scene"

    def members(self, head: int) -> list[int]:
        """Return the numbers of the bodies that one of the World consists of."""
        return [at for at in range(self.model.nbody) if self.model.body_weldid[at] == head]

    def turn(self, member: int, head: int) -> Rotation:
        """Return the rotation of a member in the frame of its body of the World."""
        return self._within(head, member, np.zeros(3))[1]

    def mass_kg(self, head: int) -> float:
        """Return the mass of a body of the World."""
        return float(sum(self.model.body_mass[at] for at in self.members(head))) if head else HELD_KG

    def body(self, head: int) -> Body:
        """Return a body of the World, without a surface of its own."""
        if not head:
            return Body(self.name(head), HELD_KG, (), inertia=Inertia((1.0, 1.0, 1.0)))
        center, inertia = self._inertia(head)
        parts = tuple(self._parts(head))
        return Body(self.name(head), self.mass_kg(head), parts, vector(center), inertia=inertia)

    def joint(self, head: int) -> Joint:
        """Return the joint that carries a body, without a motor; it starts at zero."""
        model, at = self.model, int(self.model.body_jntadr[head])
        parent, frame = self.frames[int(model.body_weldid[model.body_parentid[head]])], self.frames[head]
        dof = int(model.jnt_dofadr[at])
        limited = bool(model.jnt_limited[at])
        return Joint(
            name=joint_name(model, at),
            parent=self.name(int(model.body_weldid[model.body_parentid[head]])),
            child=self.name(head),
            origin_m=vector(parent.turn.inv().apply(frame.place_m + frame.back_m - parent.place_m)),
            axis=vector(model.jnt_axis[at] / np.linalg.norm(model.jnt_axis[at])),
            turn=quaternion(parent.turn.inv() * frame.zero),
            slides=bool(model.jnt_type[at] == SLIDE),
            limits=(float(model.jnt_range[at, 0]), float(model.jnt_range[at, 1])) if limited else None,
            damping=float(model.dof_damping[dof]),
            dry_friction=float(model.dof_frictionloss[dof]),
            armature=float(model.dof_armature[dof]),
        )

    def friction(self, head: int) -> float | None:
        """Return MuJoCo's coefficient of a body on the ground; None if it touches nothing.

        MuJoCo takes the dimension and the friction of the shape or the ground, whichever has the higher priority, and
        of equal ones the larger. Dimension 1 has no friction.
        """
        found = {self._shapes.on_the_ground(at) for at in self._geoms(head) if self._shapes.collides(at)}
        if len(found) > 1:
            self._notes.lose(
                "shapes of different friction on one body, of which the largest counts: {}", self.name(head)
            )
        return max(found, default=None)

    def _frame(self, head: int) -> Frame:
        model, data = self.model, self._data
        if not head:
            return Frame(np.zeros(3), Rotation.identity(), Rotation.identity(), np.zeros(3))
        turn, place = rotation_of(data.xquat[head]), np.array(data.xpos[head])
        at = int(model.body_jntadr[head])
        if model.jnt_type[at] == FREE:
            return Frame(place, turn, turn, np.zeros(3))
        axis, reference = model.jnt_axis[at], float(model.qpos0[model.jnt_qposadr[at]])
        place = place + turn.apply(model.jnt_pos[at])
        if model.jnt_type[at] == SLIDE:
            return Frame(place, turn, turn, turn.apply(-reference * axis))
        return Frame(place, turn, turn * Rotation.from_rotvec(-reference * axis), np.zeros(3))

    def _within(self, head: int, member: int, place_m: FloatArray) -> tuple[FloatArray, Rotation]:
        """Return a place in the frame of a member, and the turn of that frame, in the frame of a body of the World."""
        frame, turn = self.frames[head], rotation_of(self._data.xquat[member])
        place, turned = self._data.xpos[member] + turn.apply(place_m), frame.turn.inv()
        return np.asarray(turned.apply(place - frame.place_m)), turned * turn

    def _inertia(self, head: int) -> tuple[FloatArray, Inertia]:
        """Return the centre of mass and the inertia of all members together."""
        model = self.model
        found = []
        for at in self.members(head):
            center, axes = self._within(head, at, model.body_ipos[at])
            found.append((float(model.body_mass[at]), center, axes * rotation_of(model.body_iquat[at]), at))
        heavy = [each for each in found if each[0] > 0]
        if weightless := [each[3] for each in found if each[0] <= 0 and model.body_inertia[each[3]].any()]:
            names = [body_name(model, at) for at in weightless]
            self._notes.lose("inertia without mass is left out: {}", *names)
        if len(heavy) == 1:
            _, center, axes, at = heavy[0]
            return center, Inertia(vector(model.body_inertia[at]), quaternion(axes))
        mass = sum(each[0] for each in heavy)
        center = np.asarray(sum(each[0] * each[1] for each in heavy) / mass)
        total = np.zeros((3, 3))
        for kg, place, axes, at in heavy:
            to = place - center
            total += tensor(model.body_inertia[at], axes) + kg * (to @ to * np.eye(3) - np.outer(to, to))
        moments, turn = np.linalg.eigh(total)
        turn[:, 2] *= np.sign(np.linalg.det(turn))
        return center, Inertia(vector(moments), quaternion(Rotation.from_matrix(turn)))

    def _geoms(self, head: int) -> list[int]:
        model = self.model
        return [at for at in range(model.ngeom) if model.body_weldid[model.geom_bodyid[at]] == head]

    def _parts(self, head: int) -> Iterator[Part]:
        model, geoms = self.model, self._geoms(head)
        touching = [at for at in geoms if self._shapes.collides(at)]
        shown = geoms if self._options.visuals or not touching else touching
        if len(shown) < len(geoms):
            self._notes.lose(
                "shapes that touch nothing are left out; `-s visuals=true` keeps them: {}", self.name(head)
            )
        for geom in shown:
            center, axes = self._within(head, int(model.geom_bodyid[geom]), model.geom_pos[geom])
            part = self._shapes.part(geom, center, axes * rotation_of(model.geom_quat[geom]))
            if part is not None:
                yield part


def joint_name(model: Handle, at: int) -> str:
    """Return the name of a joint, or one made of its number."""
    return str(model.joint(at).name) or f"joint{at}"


def joint_number(model: Handle, name: str) -> int:
    """Return the number of the joint with a name."""
    return next(at for at in range(model.njnt) if joint_name(model, at) == name)
