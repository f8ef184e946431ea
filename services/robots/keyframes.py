"""Keyframes of an MJCF by the names of its joints, which stay the same while joints are added or fixed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.notes import Notes

INIT_QPOS = "init_qpos"
"""Name of the numbers that are the start in Gymnasium's files."""


@dataclass(frozen=True)
class Keyframe:
    """The start of a robot in its file.

    Attributes:
        name: its name in the file.
        angles: angle or place of each hinge and slide, by the name of the joint, or by the number of its body.
        base: `(7,)`: place and quaternion of a free base; None if the file has no free joint.
    """

    name: str
    angles: Mapping[str | int, float]
    base: FloatArray | None

    def qpos(self, model: Any) -> FloatArray:  # noqa: ANN401
        """Return MuJoCo's `qpos`, `(nq,)`, of a model whose joints are not those of the file."""
        qpos = np.array(model.qpos0)
        if self.base is not None and model.jnt_type[0] == 0:
            qpos[:7] = self.base
        for at in range(model.njnt):
            if model.jnt_type[at] >= 2:
                place = int(model.jnt_qposadr[at])
                qpos[place] = self.angles.get(_key(model, at), qpos[place])
        return qpos


def take_keyframes(spec: Any, notes: Notes, *, with_sensors: bool) -> tuple[Keyframe, ...]:  # noqa: ANN401
    """Return the keyframes of a spec, and then its `init_qpos`; delete what a change of the joints would break.

    MuJoCo pads the keyframes of a spec to which a joint is added at their end: angles would become a pose of the base.

    Args:
        spec: MuJoCo's `MjSpec` as it was read; it loses its keyframes.
        notes: what is said about it.
        with_sensors: whether the sensors are deleted too, since joints or actuators will be.
    """
    found = _keyframes(spec) if spec.keys or any(each.name == INIT_QPOS for each in spec.numerics) else ()
    sensors = list(spec.sensors) if with_sensors else []
    if sensors:
        notes.lose(f"{len(sensors)} sensors are lost")
    for each in [*spec.keys, *sensors]:
        spec.delete(each)
    return found


def _keyframes(spec: Any) -> tuple[Keyframe, ...]:  # noqa: ANN401
    copy = spec.copy()
    copy.compiler.fusestatic = False
    copy.compiler.balanceinertia = True
    copy.compiler.boundmass = copy.compiler.boundinertia = 1.0  # its masses are of no use, and `mend` comes later
    model = copy.compile()
    found = [(str(model.key(at).name), model.key_qpos[at]) for at in range(model.nkey)]
    for at in range(model.nnumeric):
        if model.numeric(at).name == INIT_QPOS and model.numeric_size[at] == model.nq:
            found.append((INIT_QPOS, model.numeric(at).data))
    return tuple(_keyframe(model, name, np.array(qpos)) for name, qpos in found)


def _keyframe(model: Any, name: str, qpos: FloatArray) -> Keyframe:  # noqa: ANN401
    places = {at: int(model.jnt_qposadr[at]) for at in range(model.njnt)}
    angles = {_key(model, at): float(qpos[place]) for at, place in places.items() if model.jnt_type[at] >= 2}
    free = [place for at, place in places.items() if model.jnt_type[at] == 0]
    return Keyframe(name, angles, qpos[free[0] : free[0] + 7] if free else None)


def _key(model: Any, at: int) -> str | int:  # noqa: ANN401
    """Return the name of a joint, or the number of its body, as the numbers of joints change."""
    return str(model.joint(at).name) or int(model.jnt_bodyid[at])
