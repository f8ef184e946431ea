"""Static and dynamic friction in an engine with one coefficient: each link in contact sticks or slides."""

from math import hypot
from typing import Any, NamedTuple

from gaplab.services.core.world import Material
from gaplab.services.engines.pybullet.scene import PyBulletScene

SLIDES = 0.999
"""Share of the largest static friction above which a sticking link slides."""

STICKS_AGAIN = 0.9
"""Share of the largest dynamic friction below which a sliding link sticks again."""

LINK, NORMAL_FORCE, FRICTION_1, FRICTION_2 = 3, 9, 10, 12
"""Indices into a contact point from `getContactPoints`."""

UNLOADED = (0.0, 0.0)


class _Limits(NamedTuple):
    """A link's coefficients, and the shares of its load at which it slides and sticks again."""

    static: float
    dynamic: float
    slides_from: float
    sticks_below: float

    @classmethod
    def of(cls, material: Material) -> "_Limits":
        """Return the limits in a material."""
        dynamic = material.dynamic_friction
        static = max(material.static_friction, dynamic)
        return cls(static, dynamic, SLIDES * static, STICKS_AGAIN * dynamic)


class StickSlip:
    """Steps a scene, and sets the coefficient of each link after each step: static or dynamic.

    A link in contact first sticks. It slides when its friction reaches the static limit. It sticks again when its
    friction is clearly below the dynamic limit, which shows that less was enough to hold it, or when it bears no load.
    For a link with several contact points, their sums count.
    """

    def __init__(self, scene: PyBulletScene) -> None:
        self._scene = scene
        self._limits = {link: _Limits.of(material) for link, material in scene.materials.items()}
        self._sliding: set[int] = set()

    def step(self, count: int) -> None:
        """Advance by a number of time steps."""
        bullet, robot, client = self._scene.bullet, self._scene.robot, self._scene.client
        advance, contacts = self._scene.advance, bullet.getContactPoints
        for _ in range(count * self._scene.inner_steps):
            advance()
            self._switch(contacts(robot, physicsClientId=client))

    def _switch(self, points: tuple[tuple[Any, ...], ...]) -> None:
        bearing: dict[int, tuple[float, float]] = {}
        for point in points:
            if (normal := point[NORMAL_FORCE]) > 0.0:
                load, friction = bearing.get(point[LINK], UNLOADED)
                bearing[point[LINK]] = load + normal, friction + hypot(point[FRICTION_1], point[FRICTION_2])
        for link, (load, friction) in bearing.items():
            if link in self._sliding:
                if friction < self._limits[link].sticks_below * load:
                    self._stick(link)
            elif friction >= self._limits[link].slides_from * load:
                self._slide(link)
        for link in self._sliding.difference(bearing):
            self._stick(link)

    def _stick(self, link: int) -> None:
        self._sliding.remove(link)
        self._scene.set_friction(link, self._limits[link].static)

    def _slide(self, link: int) -> None:
        self._sliding.add(link)
        self._scene.set_friction(link, self._limits[link].dynamic)
