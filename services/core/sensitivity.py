"""The sensitivity check: does a tunable change fitness at all, how much, and how smoothly.

A tunable is looked at along a *profile*: the fitness of controllers while it goes through its bounds and the others
stay in the middle of theirs. In the middle, not where the robot has them: that is reality, unless a spec says
otherwise, and must not be told. A profile says as much as its controllers, and most genomes hardly move a robot; so
some were evolved for a short while, each in a random simulator of its own, beside the known one and random ones.

With f the fitness of controller c at the k-th of K evenly spaced values, and everything pooled over controllers, so
that those on which the tunable acts count by how much it does:

    effect²      mean over c of the variance of f along k
    noise²       mean over c and k of 2/3 · (½ f(k−1) + ½ f(k+1) − f(k))²
    roughness    noise / effect: 0 for what is smooth at the distance of two values, 1 for independent values

Source: the estimate of noise is that of Gasser, Sroka and Jennen-Steinmetz 1986; a profile for each controller is what
Goldstein et al. 2015 call individual conditional expectation; what is made of them is gaplab's.
"""

from dataclasses import dataclass
from math import inf, isfinite, isnan

import numpy as np

from gaplab.schemas.sensitivity import Sensitivity, Verdict
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.ports import Simulate
from gaplab.services.core.search import maximise
from gaplab.services.core.streams import stream
from gaplab.services.core.types import Space

RANDOM, EVOLVED = 3, 4
"""Controllers of a check, beside the known one."""

NOTHING = 0.01
"""A relative effect up to this is none: chaotic physics alone has as much. Source: docs/decisions/sensitivity.md."""

ROUGH = 0.5
"""A roughness above this is rough: tuning finds it little better than chance. Source: docs/decisions/sensitivity.md."""

VERSION = 1
"""Of all that is here: what is found by another version is another check."""

SEED = 0
"""Of every check: what it finds belongs to robot, engine and tunables, not to an experiment."""


@dataclass(frozen=True)
class Effort:
    """How much a check simulates.

    Attributes:
        points: values of each tunable.
        evaluations: of each short evolution.
    """

    points: int
    evaluations: int

    def rollouts(self, tunables: int) -> int:
        """At most, for so many tunables."""
        return (1 + RANDOM + EVOLVED) * tunables * self.points + EVOLVED * self.evaluations


@dataclass(frozen=True, eq=False)
class Subject:
    """What is checked.

    Attributes:
        simulate: fitness in simulation.
        genomes: the space of controllers.
        known: `(g,)`, the hand-designed genome.
        parameters: the space of simulators.
        names: of the tunables, in its order.
    """

    simulate: Simulate
    genomes: Space
    known: Genome
    parameters: Space
    names: tuple[str, ...]


def check(subject: Subject, optimizer: Optimizer, effort: Effort) -> tuple[Sensitivity, ...]:
    """What each tunable does to fitness, in their order; the same whenever and wherever it is asked.

    Args:
        subject: that is checked.
        optimizer: of the short evolutions.
        effort: how much is simulated.
    """
    genomes = controllers(subject, optimizer, effort.evaluations)
    values = np.linspace(subject.parameters.lower, subject.parameters.upper, effort.points)
    profiles = [profile(subject, genomes, index, column) for index, column in enumerate(values.T)]
    spread = spread_between(np.concatenate(profiles, axis=1))
    return tuple(
        sensitivity(name, column, fitness, spread)
        for name, column, fitness in zip(subject.names, values.T, profiles, strict=True)
    )


def controllers(subject: Subject, optimizer: Optimizer, evaluations: int) -> Genomes:
    """`(c, g)`: the known genome, random ones, and the fittest of short searches, each in a random simulator."""
    drawn = subject.genomes.draw(RANDOM, stream(SEED, "sensitivity", "draw"))
    evolved = [_evolved(subject, optimizer, evaluations, number) for number in range(EVOLVED)]
    return np.array([subject.known, *drawn, *evolved])


def _evolved(subject: Subject, optimizer: Optimizer, evaluations: int, number: int) -> Genome:
    rng = stream(SEED, "sensitivity", "evolve", number)
    simulator = subject.parameters.draw(1, rng)
    found = maximise(
        optimizer,
        subject.genomes,
        lambda asked: subject.simulate(asked.genomes, simulator)[:, 0],
        evaluations,
        rng,
    )
    best: Genome = found.genomes[0]
    return best


def profile(subject: Subject, genomes: Genomes, tunable: int, values: FloatArray) -> Fitnesses:
    """`(c, k)`: each controller's fitness at each value of one tunable, the others in the middle of their bounds."""
    space = subject.parameters
    parameters = np.tile(space.lower + space.extent / 2, (len(values), 1))
    parameters[:, tunable] = values
    return subject.simulate(genomes, parameters)


def spread_between(fitness: Fitnesses) -> float:
    """The standard deviation of the mean fitness of controllers `(c, ...)`; nan if less than two have one."""
    means = [row[np.isfinite(row)].mean() for row in fitness if np.isfinite(row).any()]
    return float(np.std(means, ddof=1)) if len(means) > 1 else float("nan")


def sensitivity(name: str, values: FloatArray, fitness: Fitnesses, spread: float) -> Sensitivity:
    """What a profile `(c, k)` at values `(k,)` shows, against the spread of fitness between controllers."""
    effect, roughness = effect_and_roughness(fitness)
    relative = _relative(effect, spread)
    return Sensitivity(
        name=name,
        effect=_known(effect),
        relative_effect=_known(relative),
        roughness=_known(roughness),
        failures=int(np.isnan(fitness).sum()),
        verdict=verdict(relative, roughness),
        values=tuple(values.tolist()),
        fitness=tuple(tuple(map(_known, row)) for row in fitness.tolist()),
    )


def effect_and_roughness(fitness: Fitnesses) -> tuple[float, float]:
    """Both as this module defines them, of a profile `(c, k)`; roughness is 0 where there is no effect.

    A controller counts where physics did not fail at three neighbouring values; both are nan if none does.
    """
    deviations = (fitness[:, :-2] + fitness[:, 2:]) / 2 - fitness[:, 1:-1]
    counting = np.isfinite(deviations).any(axis=1)
    if not counting.any():
        return float("nan"), float("nan")
    risen = fitness[counting] - np.nanmin(fitness[counting], axis=1, keepdims=True)  # exactly 0 where nothing changes
    variance = float(np.nanvar(risen, axis=1, ddof=1).mean())
    noise = float(np.nanmean(deviations[counting] ** 2)) * 2 / 3
    return variance**0.5, (noise / variance) ** 0.5 if variance > 0 else 0.0


def verdict(relative_effect: float, roughness: float) -> Verdict:
    """Nothing, or else rough, or else smooth; unknown if one of the two is nan."""
    if isnan(relative_effect) or isnan(roughness):
        return Verdict.UNKNOWN
    if relative_effect <= NOTHING:
        return Verdict.NOTHING
    return Verdict.ROUGH if roughness > ROUGH else Verdict.SMOOTH


def warning(found: Sensitivity) -> str | None:
    """What a person who is about to tune this should know, in a sentence; None if nothing."""
    lower, upper = found.values[0], found.values[-1]
    where = f"{found.name} over {lower:g} to {upper:g}"
    match found.verdict:
        case Verdict.NOTHING:
            share = 100 * (found.relative_effect or 0.0)
            return f"{where} does nothing: it changes fitness by {share:.2g} % of what controllers differ by"
        case Verdict.ROUGH:
            share = 100 * (found.roughness or 0.0)
            return f"{where} is rough: {share:.0f} % of what it does to fitness jumps from value to value"
        case Verdict.UNKNOWN:
            return f"{where} is unknown: physics failed in {found.failures} of the check's rollouts"
        case Verdict.SMOOTH:
            return None


def _relative(effect: float, spread: float) -> float:
    """The effect over the spread: 0 without an effect, infinite without a spread."""
    if effect == 0:
        return 0.0
    return effect / spread if spread != 0 else inf


def _known(value: float) -> float | None:
    return float(value) if isfinite(value) else None
