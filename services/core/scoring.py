"""Formulas for the score of a controller as the next sample: the paper's, and how much its outcome tells of tunables.

The paper's take the fitness of n controllers in m simulators, `(n, m)`, and return `(n,)`. A nan fitness makes the
controller's score nan, which never wins. The exception is a simulator of weight 0, whose physics failed on a sample: it
is ignored, because a diverse ensemble may keep it although it fails on every controller.

A good next sample depends on the tunables, so that it tells simulators apart. But contact is chaotic: an outcome that
a tiny change of the tunables turns over tells nothing.
"""

from collections.abc import Sequence

import numpy as np

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genomes, Parameters
from gaplab.services.core.space import Space
from gaplab.services.core.types import Belief, Sample, Simulator

NEAREST = 1e-6
"""Smallest distance between a controller and a sample: at 0 the paper's 1/d is infinite."""

NO_FLOOR = 1e-300
"""Floor under Σe² that guards against division by zero alone."""


def weighted_mean(fitnesses: Fitnesses, weights: FloatArray) -> FloatArray:
    """Return the expected fitness: the mean over simulators, weighted by accuracy. Source: paper, section 2.

    Args:
        fitnesses: `(n, m)` of n genomes in m simulators.
        weights: `(m,)`, non-negative, summing to 1.
    """
    return _weighty(fitnesses, weights) @ weights


def weighted_deviation(fitnesses: Fitnesses, weights: FloatArray) -> FloatArray:
    """Return the disagreement `(n,)`: the standard deviation over simulators, weighted by accuracy.

    Arguments are as of `weighted_mean`.

    Source: paper, section 2, *Informative*.
    """
    deviations = _weighty(fitnesses, weights) - weighted_mean(fitnesses, weights)[:, None]
    return np.sqrt(deviations**2 @ weights)


def deviation_of_readings(readings: FloatArray, weights: FloatArray) -> FloatArray:
    """Return `(n,)`: the root of the summed weighted variances of readings `(n, m, q)` over simulators.

    Weights are as of `weighted_mean`.
    """
    there = np.where(weights[:, None] > 0, readings, 0.0)
    means = np.einsum("nmq,m->nq", there, weights)
    return np.asarray(np.sqrt(np.einsum("nmq,m->n", (there - means[:, None]) ** 2, weights)))


def uniqueness_penalty(genomes: Genomes, fitness: FloatArray, samples: Sequence[Sample]) -> FloatArray:
    """Return 1/(100 N) Σ 1/d(x, y) over the N samples y; 0 before the first sample.

    d is the Euclidean distance over genome and fitness together: the controller's fitness is the simulated one, the
    sample's the real one. It adds genes and fitness, whatever their units.

    Source: paper, section 2, *Simulated fit and unique*.

    Args:
        genomes: `(n, g)`.
        fitness: `(n,)` in the simulator.
        samples: samples whose measurement succeeded.
    """
    if not samples:
        return np.zeros(len(genomes))
    points = np.column_stack([genomes, fitness])
    others = np.array([np.append(each.genome, each.fitness) for each in samples])
    return _penalty(points[:, None, :] - others[None, :, :])


def scaled_uniqueness_penalty(genomes: Genomes, fitness: FloatArray, belief: Belief) -> FloatArray:
    """Return the penalty in units that cancel: it is the same share of fitness for any robot and unit.

    Genes are in units of their extents, phases the shorter way around. Fitness and penalty are in units of
    `belief.scale`.

    Source: gaplab.

    Args:
        genomes: `(n, g)`.
        fitness: `(n,)` in the simulator.
        belief: its samples whose measurement succeeded count.
    """
    if not belief.learnable:
        return np.zeros(len(genomes))
    others = np.array([each.genome for each in belief.learnable])
    real = np.array([each.fitness for each in belief.learnable])
    genes = belief.space.apart(genomes[:, None, :], others[None, :, :])
    gaps = (fitness[:, None] - real[None, :]) / belief.scale
    return belief.scale * _penalty(np.concatenate([genes, gaps[:, :, None]], axis=2))


def _penalty(differences: FloatArray) -> FloatArray:
    """Return the penalty `(n,)` of differences `(n, N, g + 1)` between controllers and samples."""
    distances = np.linalg.norm(differences, axis=2)
    penalty: FloatArray = (1.0 / np.maximum(distances, NEAREST)).mean(axis=1) / 100.0
    return penalty


def simulator_weights(squared_errors: FloatArray, floor: float) -> FloatArray:
    """Return weights `(m,)` of simulators, with sum 1: their fitness 1/Σe², with a floor under Σe².

    The paper's weights are the fitnesses themselves. Without the floor, one near-perfect simulator takes all the
    weight, and no disagreement is left. Weights are equal before any sample, when all errors are 0, and if all
    simulators fail.

    Source: paper, section 2, *Informative*; the floor is gaplab's.

    Args:
        squared_errors: `(m,)`, inf where the physics failed.
        floor: floor under Σe², above 0, in the unit of Σe².
    """
    weights = 1.0 / np.maximum(squared_errors, floor)
    total = weights.sum()
    return weights / total if total > 0 else np.full(len(weights), 1.0 / len(weights))


def weights_of(simulators: Sequence[Simulator], floor: float) -> FloatArray:
    """Return weights `(m,)` of tuned simulators, with sum 1: their posterior shares, or else `simulator_weights`."""
    shares = [each.weight for each in simulators if each.weight is not None]
    if len(shares) == len(simulators):
        return np.asarray(shares / np.sum(shares))
    return simulator_weights(np.array([each.squared_error for each in simulators]), floor)


def _weighty(fitnesses: Fitnesses, weights: FloatArray) -> Fitnesses:
    """Return the fitnesses, with 0 for simulators of weight 0, because 0 times nan would be nan."""
    return fitnesses if np.all(weights > 0) else np.where(weights > 0, fitnesses, 0.0)


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
    """Return `(n,)`: the sum of squared slopes; one very sensitive tunable can dominate it."""
    return np.asarray(np.trace(information, axis1=1, axis2=2))
