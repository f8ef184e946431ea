"""The PhysX engine, with one cached scene for each kind of world."""

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from warnings import catch_warnings, simplefilter

from gaplab.schemas.base import Frozen
from gaplab.services.engines.base import USUALLY_IN_PLACE
from gaplab.services.engines.physx.robot import MOST_SURFACES
from gaplab.services.engines.physx.scene import PhysXScene, surface_names
from gaplab.services.engines.stepped import SteppedEngine
from gaplab.services.world.motions import Tilt
from gaplab.services.world.world import World


class PhysX(SteppedEngine[PhysXScene]):
    """PhysX on the CPU, the paper's own engine, which has all three coefficients itself.

    Deterministic within one version and architecture; single precision; needs neither a GPU nor Vulkan.
    Restitution acts on impacts faster than 0.2 m/s. Dry friction is a torque that is set before each step, by the load
    of the step before.
    """

    name = "physx"
    source = "PhysX 5.3.1 through SAPIEN, https://sapien.ucsd.edu, version 3.0.3; docs/engines.md"
    library = "sapien"
    in_place = USUALLY_IN_PLACE | {"body.inertia", "joint.armature", "motor.follows"}
    # gravity, and so the slope, is given when a scene is created
    install = "pip install 'gaplab[physx]'"

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self._library = _sapien()

    @classmethod
    def exceeded(cls, world: World) -> str | None:
        """Return how many surfaces the world has, if PhysX cannot tell them apart."""
        found = len(surface_names(world)) - 1
        return None if found <= MOST_SURFACES else f"it has {found} special surfaces, and PhysX {MOST_SURFACES}"

    def _build(self, world: World) -> PhysXScene:
        return PhysXScene(self._library, world)

    def _start(self, scene: PhysXScene, world: World, tilt_rad: Tilt) -> Callable[[int], None]:
        scene.start(world, tilt_rad)
        return scene.step


def _sapien() -> ModuleType:
    """Import the library without its warnings about graphics, which is not used."""
    with catch_warnings():
        simplefilter("ignore")  # no Vulkan on the machine; older versions import `pkg_resources`
        return import_module("sapien")
