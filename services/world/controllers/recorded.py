"""A controller that repeats what was recorded."""

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.space import Space
from gaplab.services.world import robot_library
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.motions import Motion
from gaplab.services.world.world import World


class RecordedOptions(Frozen):
    """A pool, by its hash; its name is for people."""

    sha256: str = Field(default="", max_length=64, description="hash of the pool")
    name: str = Field(default="", max_length=60, description="name of the pool, for people")


class RecordedController(Controller):
    """The commands of a recording, from where it began; its gene is the number of the recording in a pool.

    A spec with a recorded reality gets it by itself.
    """

    name = "recorded"
    Options = RecordedOptions
    options: RecordedOptions

    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Read the pool."""
        self._pool, self._world = robot_library.pool(self.options.sha256, self.options.name), world
        self._observe_s, self._motions = observe_s, dict[int, Motion]()
        self.space = Space.box([0.0], [float(max(1, len(self._pool.recordings) - 1))])
        self.known = frozen([0.0])

    def motion(self, genome: Genome) -> Motion:
        """Return the motion of a recording."""
        number = int(genome[0])
        if number not in self._motions:
            self._motions[number] = self._pool.motion(number, self._world).observed_at(self._observe_s)
        return self._motions[number]
