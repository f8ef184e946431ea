"""Two coefficients of friction in an engine that has one: each link in contact sticks or slides."""

from math import hypot
from typing import Any

from gaplab.services.core.world import Material
from gaplab.services.engines.pybullet.scene import PyBulletScene

SLIDES = 0.999
"""A sticking link slides when its friction reaches this share of what the static coefficient allows."""

STICKS_AGAIN = 0.9
"""A sliding link sticks again when its friction falls below this share of what the dynamic coefficient allows."""

LINK, NORMAL_FORCE, FRICTION_1, FRICTION_2 = 3, 9, 10, 12
"""Places in a contact point, as `getContactPoints` returns it."""

UNLOADED = (0.0, 0.0)


class StickSlip:
    """Steps a scene, and after each step gives each link the coefficient of its state: static or dynamic.

    A link in contact starts out sticking. It slides once its friction is all that the static coefficient allows. It
    sticks again once its friction is clearly less than the dynamic one allows, for then less was enough to hold it; or
    once it bears no load. Of a link with several contact points the sums count.
    """

    def __init__(self, scene: PyBulletScene, material: Material) -> None:
        self._scene = scene
        self._material = material
        self._slides_from = SLIDES * material.static_friction
        self._sticks_below = STICKS_AGAIN * material.dynamic_friction
        self._sliding: set[int] = set()

    def step(self, count: int) -> None:
        """Go on by so many time steps."""
        bullet, robot, client = self._scene.bullet, self._scene.robot, self._scene.client
        advance, contacts = bullet.stepSimulation, bullet.getContactPoints
        for _ in range(count):
            advance(physicsClientId=client)
            self._switch(contacts(robot, physicsClientId=client))

    def _switch(self, points: tuple[tuple[Any, ...], ...]) -> None:
        bearing: dict[int, tuple[float, float]] = {}
        for point in points:
            if (normal := point[NORMAL_FORCE]) > 0.0:
                load, friction = bearing.get(point[LINK], UNLOADED)
                bearing[point[LINK]] = load + normal, friction + hypot(point[FRICTION_1], point[FRICTION_2])
        for link, (load, friction) in bearing.items():
            if link in self._sliding:
                if friction < self._sticks_below * load:
                    self._stick(link)
            elif friction >= self._slides_from * load:
                self._slide(link)
        for link in self._sliding.difference(bearing):
            self._stick(link)

    def _stick(self, link: int) -> None:
        self._sliding.remove(link)
        self._scene.set_friction(link, self._material.static_friction)

    def _slide(self, link: int) -> None:
        self._sliding.add(link)
        self._scene.set_friction(link, self._material.dynamic_friction)
