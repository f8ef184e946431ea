"""Bodies and joints of a World from a compiled model: bodies that are fixed to each other become one."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.shapes import Part
from gaplab.services.core.world import Body, Inertia, Joint
from gaplab.services.robots.geometry import Shapes, quaternion, rotation_of, vector
from gaplab.services.robots.notes import Notes
from gaplab.services.robots.options import ImportOptions
from gaplab.services.robots.reading import Source, body_name, mujoco_library

FREE, BALL, SLIDE, HINGE = 0, 1, 2, 3
"""MuJoCo's types of joints."""

HELD_KG = 1.0
"""Mass of the base that is made for a robot on a rail or a hinge of the scene; it never moves."""


@dataclass(frozen=True)
class Frame:
    """The frame of a World's body at the model's reference angles, in the scene.

    Attributes:
        place_m: `(3,)`.
        turn: rotation.
        zero: rotation with its joint at zero.
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

    def __init__(self, source: Source, options: ImportOptions, notes: Notes) -> None:
        mujoco, self.model = mujoco_library(), source.model
        self._options, self._notes = options, notes
        self._data = mujoco.MjData(self.model)
        self._data.qpos[:] = self.model.qpos0
        mujoco.mj_kinematics(self.model, self._data)
        weld = self.model.body_weldid
        self.heads = [at for at in range(self.model.nbody) if weld[at] == at and (at > 0 or self.is_held)]
        self.frames = {head: self._frame(head) for head in self.heads}
        self._shapes = Shapes(self.model, options, notes)
        for head in self.heads:
            if others := [at for at in self.members(head) if at != head]:
                names = [body_name(self.model, at) for at in others]
                notes.lose(f"fixed to {self.name(head)}, and part of it: {{}}", *names)

    @property
    def is_held(self) -> bool:
        """Whether the base is the scene, since the first joint is not free."""
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
        model = self.model
        geoms = [at for at in range(model.ngeom) if model.body_weldid[model.geom_bodyid[at]] == head]
        touching = [at for at in geoms if self._shapes.collides(at)]
        found = {self._shapes.on_the_ground(at) for at in touching}
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
        tensor = np.zeros((3, 3))
        for kg, place, axes, at in heavy:
            to, turn = place - center, axes.as_matrix()
            tensor += turn @ np.diag(model.body_inertia[at]) @ turn.T + kg * (to @ to * np.eye(3) - np.outer(to, to))
        moments, turn = np.linalg.eigh(tensor)
        turn[:, 2] *= np.sign(np.linalg.det(turn))
        return center, Inertia(vector(moments), quaternion(Rotation.from_matrix(turn)))

    def _parts(self, head: int) -> Iterator[Part]:
        model = self.model
        geoms = [at for at in range(model.ngeom) if model.body_weldid[model.geom_bodyid[at]] == head]
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


def joint_name(model: Any, at: int) -> str:  # noqa: ANN401
    """Return the name of a joint, or one made of its number."""
    return str(model.joint(at).name) or f"joint{at}"


def joint_number(model: Any, name: str) -> int:  # noqa: ANN401
    """Return the number of the joint with a name."""
    return next(at for at in range(model.njnt) if joint_name(model, at) == name)
