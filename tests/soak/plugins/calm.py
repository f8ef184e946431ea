"""An external strategy that behaves; the soak edits its neighbours."""

from typing import Any

from gaplab.plugins import Strategy


class Calm(Strategy):
    """The fittest in simulation."""

    name = "calm"

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        return search(lambda genomes, fitnesses: fitnesses[:, 0])
