"""A World as a URDF file, as users give it to PyBullet."""

from gaplab.services.core.shapes import Box, Sphere
from gaplab.services.core.world import Body, Joint, World


def urdf(world: World) -> str:
    """Return the robot of the world as URDF, with the material on every link."""
    links = "".join(_link(body, world) for body in world.bodies)
    return f'<?xml version="1.0"?>\n<robot name="robot">{links}{"".join(map(_joint, world.joints))}</robot>\n'


def _link(body: Body, world: World) -> str:
    origin = f'<origin xyz="{_numbers(body.center_m)}"/>'
    shape = body.shape
    if isinstance(shape, Box):
        geometry, edges = f'<box size="{_numbers(shape.size_m)}"/>', shape.size_m
    else:
        assert isinstance(shape, Sphere)
        geometry, edges = f'<sphere radius="{shape.radius_m}"/>', (2 * shape.radius_m,) * 3
    squares = [edge**2 for edge in edges]
    xx, yy, zz = (body.mass_kg / 12 * (sum(squares) - square) for square in squares)
    collision = f"<collision>{origin}<geometry>{geometry}</geometry></collision>" if body.collides else ""
    return (
        f'<link name="{body.name}"><contact><lateral_friction value="{world.material.static_friction}"/>'
        f'<restitution value="{world.material.restitution}"/></contact>'
        f'<inertial>{origin}<mass value="{body.mass_kg}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>{collision}</link>'
    )


def _joint(joint: Joint) -> str:
    return (
        f'<joint name="{joint.name}" type="continuous"><parent link="{joint.parent}"/><child link="{joint.child}"/>'
        f'<origin xyz="{_numbers(joint.origin_m)}"/><axis xyz="{_numbers(joint.axis)}"/></joint>'
    )


def _numbers(vector: tuple[float, float, float]) -> str:
    return " ".join(map(str, vector))
