"""The PyBullet engine, with one cached server for each kind of world."""

from collections.abc import Callable
from importlib import import_module

from gaplab.schemas.base import Frozen
from gaplab.services.engines.base import ALL_FIELDS, USUALLY_IN_PLACE
from gaplab.services.engines.pybullet.robot import MOST_LINKS, links_of
from gaplab.services.engines.pybullet.scene import PyBulletScene, StickSlip
from gaplab.services.engines.stepped import SteppedEngine
from gaplab.services.world.motions import Tilt
from gaplab.services.world.world import World


class PyBullet(SteppedEngine[PyBulletScene]):
    """Bullet's rigid bodies; stick-slip switching at each contact distinguishes static and dynamic friction.

    Deterministic within one version and architecture. Restitution acts on impacts faster than 0.2 m/s, Bullet's
    threshold. If dynamic friction is not below static friction, there is no switching and no cost of it. Bullet has no
    armature.
    """

    name = "pybullet"
    source = "https://pybullet.org, version 3.2.7"
    library = "pybullet"
    honours = ALL_FIELDS - {"joint.armature"}
    in_place = USUALLY_IN_PLACE | {"gravity_m_s2", "slope_rad"}
    install = "pip install pybullet, which has wheels up to Python 3.11, or choose another engine, like mujoco"

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._bullet = import_module("pybullet")
        self.failures = (self._bullet.error,)

    @classmethod
    def exceeded(cls, world: World) -> str | None:
        """Return how many links the world needs, if Bullet has fewer: one for each body and each further shape."""
        needed = len(links_of(world)) - 1 if world.bodies else 0
        if needed <= MOST_LINKS:
            return None
        return f"its bodies and shapes need {needed} links besides the base, and Bullet has {MOST_LINKS}"

    def _build(self, world: World) -> PyBulletScene:
        return PyBulletScene(self._bullet, world)

    def _start(self, scene: PyBulletScene, world: World, tilt_rad: Tilt) -> Callable[[int], None]:
        scene.start(world, tilt_rad)
        switches = any(each.dynamic_friction < each.static_friction for each in scene.materials.values())
        return StickSlip(scene).step if switches else scene.step
