"""How much the outcome of a controller depends on the tunables.

A good next sample depends on the tunables, so that it tells simulators apart. But contact is chaotic: an outcome that
a tiny change of the tunables turns over tells nothing.
"""

import numpy as np

from gaplab.services.core.arrays import FloatArray, Parameters
from gaplab.services.core.space import Space


def moved(parameters: Parameters, steps: FloatArray, tunables: Space) -> Parameters:
    """Return simulators `(m, p)` after steps; a tunable that would leave its bounds goes the other way.

    Args:
        parameters: `(m, p)`.
        steps: `(m, p)` or `(p,)`, in units of the extents, smaller than 0.5.
        tunables: bounds of the tunables.
    """
    there = parameters + steps * tunables.extent
    outside = (there < tunables.lower) | (there > tunables.upper)
    return tunables.contain(np.where(outside, parameters - steps * tunables.extent, there))


def beside(parameters: FloatArray, step: float, tunables: Space) -> Parameters:
    """Return `(p, p)`: a simulator `(p,)` with one tunable after another moved by a step, in units of its extent."""
    return moved(np.repeat(parameters[None, :], tunables.size, axis=0), step * np.eye(tunables.size), tunables)


def fisher_information(outcomes: FloatArray, parameters: Parameters, tunables: Space) -> FloatArray:
    """Return the Fisher information `(n, p, p)` of n controllers: products of slopes, summed over outcomes.

    Source: ASID (2024), SPI-Active (2025).

    Args:
        outcomes: `(n, 1 + p, k)`: k outcomes in a simulator, then in those `beside` it, in units of their noise.
        parameters: `(1 + p, p)`: these simulators.
        tunables: bounds of the tunables.
    """
    steps = np.diag(parameters[1:] - parameters[0]) / tunables.extent
    slopes = (outcomes[:, 1:] - outcomes[:, :1]) / steps[:, None]
    information: FloatArray = slopes @ slopes.transpose(0, 2, 1)
    return information


@np.errstate(invalid="ignore")
def log_determinant(information: FloatArray) -> FloatArray:
    """Return `(n,)`: how much the volume of a posterior shrinks, with unit prior variance in units of the extents."""
    return np.asarray(np.linalg.slogdet(np.eye(information.shape[1]) + information)[1])


def trace(information: FloatArray) -> FloatArray:
    """Return `(n,)`: the sum of squared slopes; one loud tunable can dominate it."""
    return np.asarray(np.trace(information, axis1=1, axis2=2))
