"""Options of an import, and its notes: what it lost or changed, and why it refuses a file.

The same file with the same options gives the same robot.
"""

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from typing import Annotated, Literal

from pydantic import Field, field_validator

from gaplab.schemas.base import Frozen
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.world.robot_files import LONGEST_LINE
from gaplab.services.world.world import MOST_VERTICES
from gaplab.services.world.world_checks import HIGHEST_M

Positive = Annotated[float, Field(gt=0)]


class ImportOptions(Frozen):
    """What the file leaves open, and what replaces the file's own values.

    Attributes:
        name: name of the robot; None for that in the file.
        fixed: whether the base never moves; a URDF does not say it.
        mend: whether masses and inertias that no rigid body has are replaced, instead of refused.
        visuals: whether shapes that touch nothing are kept where the body also has shapes that touch.
        lock: patterns of the names of joints that are fixed, like `*_finger_*`: at zero in a URDF, at `ref` in an MJCF.
        motor: motor of all motored joints, in place of the file's; None: the file's, and `position` for a URDF.
        motored: pattern of the names of joints that get a motor, like `*_knee`; for a URDF, or with `motor`.
        kp: gain of the motors, N·m/rad; None: computed.
        kd: damping of the motors, N·m·s/rad; None: computed.
        position_gain: share of the error that a servo closes in a step.
        max_torque: largest torque of the motors; None: the file's, or computed.
        time_step_s: time step; None: MJCF's own, and 1/240 s for a URDF.
        start: angle at time 0 by pattern of joint names; a later pattern wins.
        ground_m: height of the ground, which a robot whose base is free touches; None: 0.
        turn: roll, pitch and yaw of the base at time 0, rad, as in a URDF; None: the file's.
        keyframe: name of the MJCF's keyframe that is the start; None for the first.
        vertices: largest number of vertices of a hull.
        static_friction: None: the file's, or gaplab's.
        dynamic_friction: None: the same.
        observed: name of the body whose motion is the trajectory; None: the base, and the last link of a fixed robot.
        controller: usual controller; None: `cpg`, and `sine` for a fixed base.
        task: usual task; None: `walk`, and `reach` for a fixed base.
    """

    name: str | None = None
    fixed: bool = False
    mend: bool = False
    visuals: bool = False
    lock: tuple[str, ...] = ()
    motor: Literal["servo", "position", "velocity", "torque"] | None = None
    motored: str = "*"
    kp: Positive | None = None
    kd: Positive | None = None
    position_gain: Annotated[float, Field(gt=0, le=1)] = 0.1
    max_torque: Positive | None = None
    time_step_s: Annotated[float, Field(gt=0, le=0.1)] | None = None
    start: dict[str, float] = Field(default_factory=dict)
    ground_m: Annotated[float, Field(ge=-HIGHEST_M, le=HIGHEST_M)] | None = None
    turn: tuple[float, float, float] | None = None
    keyframe: str | None = None
    vertices: Annotated[int, Field(ge=8, le=MOST_VERTICES)] = 32
    static_friction: Annotated[float, Field(ge=0)] | None = None
    dynamic_friction: Annotated[float, Field(ge=0)] | None = None
    observed: str | None = None
    controller: PluginRef | None = None
    task: PluginRef | None = None

    def locks(self, joint: str) -> bool:
        """Return whether a joint is fixed, by its name."""
        return any(fnmatchcase(joint, pattern) for pattern in self.lock)

    @field_validator("turn", mode="before")
    @classmethod
    def _split_a_text(cls, value: object) -> object:
        if not isinstance(value, str):
            return value
        try:
            roll, pitch, yaw = map(float, value.split(","))
        except ValueError as error:
            msg = f"turn must be three angles, roll,pitch,yaw in rad, like 1.5708,0,0, not {value}"
            raise ValueError(msg) from error
        return roll, pitch, yaw


MOST_NAMES = 40
"""Most names in a line of what is lost."""


class Notes:
    """Lines about one import, in the order of its steps; what is `refused` has no place in a World."""

    def __init__(self) -> None:
        self._lost: dict[str, list[str]] = {}
        self.refused: list[str] = []

    @property
    def lost(self) -> list[str]:
        """Return what is lost or changed, a line each, with as many names as a robot file permits."""
        return [_fitting(line, names) for line, names in self._lost.items()]

    def lose(self, line: str, *names: str) -> None:
        """Note once what is lost or changed; `{}` in the line becomes the names of all notes with the same line."""
        known = self._lost.setdefault(line, [])
        known += [name for name in names if name not in known]

    def refuse(self, line: str) -> None:
        """Note a reason to refuse the file."""
        self.refused.append(line)

    def refuse_unknown(self, patterns: Iterable[str], joints: Sequence[str]) -> None:
        """Note each pattern of locked joints that matches none."""
        for pattern in patterns:
            if not any(fnmatchcase(name, pattern) for name in joints):
                self.refuse(f"no joint has a name like {pattern!r}, as --lock says; joints: {listed(joints, 30)}")

    def check(self) -> None:
        """Raise all reasons to refuse the file so far.

        Raises:
            InvalidRobot: there is one.
        """
        if self.refused:
            raise InvalidRobot(self.refused)


def _fitting(line: str, names: Sequence[str]) -> str:
    texts = [line.replace("{}", listed(names, most)) for most in range(MOST_NAMES, 0, -1)]
    shortest = texts[-1]
    return next((text for text in texts if len(text) <= LONGEST_LINE), f"{shortest[: LONGEST_LINE - 1]}…")


def listed(names: Iterable[str], most: int = 6) -> str:
    """Return names in a sentence: the first few, and the number of all others."""
    all_names = list(names)
    others = len(all_names) - most
    return ", ".join(all_names[:most]) + (f" and {others} more" if others > 0 else "")
