"""Array types by shape; every number in the core is a float64."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

Genome: TypeAlias = FloatArray
"""`(g,)`: one controller."""

Genomes: TypeAlias = FloatArray
"""`(n, g)`: n controllers."""

Parameters: TypeAlias = FloatArray
"""`(m, p)`: m simulators, a row of p tunables each, in the order of the spec."""

Fitnesses: TypeAlias = FloatArray
"""`(n, m)`: the fitness of n controllers in m simulators; nan where the physics failed."""


def frozen(values: object) -> FloatArray:
    """Return a read-only float64 copy, for arrays in frozen values."""
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array
