"""A small arm for the tests of the library and of drivers: two hinges about y, and a tool."""

import json
from pathlib import Path

from gaplab.services.robots.importing import import_robot
from gaplab.services.robots.options import ImportOptions

LINK = (
    '<inertial><origin xyz="{0} 0 0"/><mass value="1"/>'
    '<inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial>'
    '<collision><origin xyz="{0} 0 0"/><geometry><box size=".1 .05 .05"/></geometry></collision>'
)
HINGE = (
    '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="{} 0 {}"/><axis xyz="0 1 0"/>'
    '<limit lower="-1.6" upper="1.6" effort="40" velocity="6"/></joint>'
)
URDF = (
    f'<robot name="arm"><link name="base">{LINK.format(0)}</link><link name="upper">{LINK.format(0.15)}</link>'
    f'<link name="tool">{LINK.format(0)}</link>{HINGE.format("shoulder", "base", "upper", 0, 0.5)}'
    f"{HINGE.format('elbow', 'upper', 'tool', 0.3, 0)}</robot>"
)
"""A tool at the end of an upper arm of 0.3 m, 0.5 m above the base; positive angles lower it."""


def imported(folder: Path, name: str = "arm", **renamed: str) -> Path:
    """Return the file of the arm on a fixed base, whose joints have these new names."""
    text = URDF
    for old, new in renamed.items():
        text = text.replace(f'"{old}"', f'"{new}"')
    (folder / f"{name}.urdf").write_text(text)
    file = folder / f"{name}.json"
    robot = import_robot(folder / f"{name}.urdf", ImportOptions(fixed=True, name=name)).robot
    file.write_text(json.dumps(robot.content))
    return file
