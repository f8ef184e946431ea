"""The sensitivity check: whether a tunable changes fitness, how much, how smoothly, and which of them act alike.

The *profile* of a tunable is the fitness of some controllers at evenly spaced values between its bounds, with the other
tunables in the middle of theirs. The robot's values would be reality, unless a spec states another, and must stay
hidden. Most genomes hardly move a robot and would show little. So the controllers are the known one, random ones, and
others from short evolutions, each in another random simulator.

f is the fitness of controller c at the k-th of K values. Variances are pooled over controllers, so a controller on
which the tunable acts more counts more:

    effect²      mean over c of the variance of f along k
    noise²       mean over c and k of 2/3 · (½ f(k−1) + ½ f(k+1) − f(k))²
    roughness    noise / effect: 0 for a profile that is smooth at this distance of values, 1 for independent values

The *slope* of a tunable for a controller is that of the line through its profile, over the tunable's bounds. Two
tunables whose slopes are proportional over all controllers can stand in for each other: what one adds to every fitness,
the other takes away. The cosine between their slopes says how far they are from that: 1 if they are proportional, and
near 0 for unrelated ones. In least squares, it is the collinearity of two columns of the Jacobian.

Source: the estimate of noise is by Gasser, Sroka and Jennen-Steinmetz 1986. A profile for each controller is an
individual conditional expectation (Goldstein et al. 2015). The verdicts are gaplab's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf, isnan

import numpy as np

from gaplab.schemas.sensitivity import Sensitivity, Verdict
from gaplab.services.core.arrays import Fitnesses, FloatArray, Genome, Genomes, known
from gaplab.services.core.optimizers.base import Optimizer
from gaplab.services.core.ports import Simulate
from gaplab.services.core.search import maximise
from gaplab.services.core.space import Space
from gaplab.services.core.streams import stream

RANDOM, EVOLVED = 3, 4
"""Numbers of random and of evolved controllers, besides the known one."""

NOTHING = 0.01
"""Largest relative effect that counts as none: chaotic physics alone has it. Source: docs/decisions/sensitivity.md."""

ROUGH = 0.5
"""Roughness above which the verdict is rough. Nothing happens there suddenly: tuned values grow less certain from
0.4 on, up to chance at 1. Source: docs/decisions/sensitivity.md."""

VERSION = 1
"""Version of this module; a result of another version is another check."""

SEED = 0
"""Seed of every check, because the result belongs to robot, engine and tunables, not to an experiment."""


@dataclass(frozen=True)
class Effort:
    """The size of a check.

    Attributes:
        points: number of values of each tunable.
        evaluations: evaluations of each short evolution.
    """

    points: int
    evaluations: int

    def rollouts(self, tunables: int) -> int:
        """Return the largest number of rollouts for this number of tunables."""
        return (1 + RANDOM + EVOLVED) * tunables * self.points + EVOLVED * self.evaluations


@dataclass(frozen=True, eq=False)
class Subject:
    """The subject of a check.

    Attributes:
        simulate: fitness in simulation.
        genomes: the space of controllers.
        known: `(g,)`, the hand-designed genome.
        parameters: the space of simulators.
        names: names of the tunables, in the order of that space.
    """

    simulate: Simulate
    genomes: Space
    known: Genome
    parameters: Space
    names: tuple[str, ...]


def check(subject: Subject, optimizer: Optimizer, effort: Effort) -> tuple[Sensitivity, ...]:
    """Return the effect of each tunable on fitness, in their order. Repeated checks give the same numbers.

    The optimizer is that of the short evolutions.
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
    """Return the known genome, random ones, and the fittest of short searches in random simulators, `(c, g)`."""
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
    """Return the profile of one tunable at values `(k,)`: the fitness of each controller at each value, `(c, k)`."""
    space = subject.parameters
    parameters = np.tile(space.lower + space.extent / 2, (len(values), 1))
    parameters[:, tunable] = values
    return subject.simulate(genomes, parameters)


def spread_between(fitness: Fitnesses) -> float:
    """Return the standard deviation between the mean fitnesses of controllers `(c, ...)`; nan if fewer than two."""
    means = [row[np.isfinite(row)].mean() for row in fitness if np.isfinite(row).any()]
    return float(np.std(means, ddof=1)) if len(means) > 1 else float("nan")


def sensitivity(name: str, values: FloatArray, fitness: Fitnesses, spread: float) -> Sensitivity:
    """Return the result of a profile `(c, k)` at values `(k,)`, relative to the spread between controllers."""
    effect, roughness = effect_and_roughness(fitness)
    relative = _relative(effect, spread)
    return Sensitivity(
        name=name,
        effect=known(effect),
        relative_effect=known(relative),
        roughness=known(roughness),
        failures=int(np.isnan(fitness).sum()),
        verdict=verdict(relative, roughness),
        values=tuple(values.tolist()),
        fitness=tuple(tuple(map(known, row)) for row in fitness.tolist()),
    )


def effect_and_roughness(fitness: Fitnesses) -> tuple[float, float]:
    """Return effect and roughness of a profile `(c, k)`; roughness is 0 without an effect.

    A controller counts if its physics succeeded at three neighbouring values. Both are nan if none does.
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
    """Return the verdict; unknown if one of the two numbers is nan."""
    if isnan(relative_effect) or isnan(roughness):
        return Verdict.UNKNOWN
    if relative_effect <= NOTHING:
        return Verdict.NOTHING
    return Verdict.ROUGH if roughness > ROUGH else Verdict.SMOOTH


def warning(found: Sensitivity) -> str | None:
    """Return a warning about tuning this parameter, with what to do about it; None if it is smooth."""
    lower, upper = found.values[0], found.values[-1]
    where = f"{found.name} over {lower:g} to {upper:g}"
    match found.verdict:
        case Verdict.NOTHING:
            share = 100 * (found.relative_effect or 0.0)
            return f"{where} does nothing: its effect on fitness is {share:.2g} % of the spread between controllers"
        case Verdict.UNKNOWN:
            return f"{where} is unknown: physics failed in {found.failures} of the check's rollouts"
    return _noise(found, where) if found.verdict is Verdict.ROUGH else None


def _noise(found: Sensitivity, where: str) -> str:
    """Return a sentence on how roughness limits the precision of the tuned value."""
    share, limit = 100 * (found.roughness or 0.0), 100 * ROUGH
    return (
        f"{where}: {share:.0f} % of its effect on fitness is noise between neighbouring values; the larger this share, "
        f"the less certain its tuned value (called rough above {limit:.0f} %; 100 % is chance). Leave it out of "
        "the tunables, or check other bounds or another engine with the command gaplab sensitivity"
    )


def _relative(effect: float, spread: float) -> float:
    """Return effect over spread: 0 without an effect, infinite without a spread."""
    if effect == 0:
        return 0.0
    return effect / spread if spread != 0 else inf


ALIKE = 0.97
"""Least cosine of slopes that counts as alike; 1 in 60 000 pairs of independent slopes of eight controllers has it."""

STRAIGHT = 0.5
"""Least share of the variance along a profile that its lines explain; else slopes say too little."""

FEWEST = 4
"""Fewest controllers that are compared."""


def alike(findings: Sequence[Sensitivity]) -> tuple[str, ...]:
    """Return a warning for each pair of smooth tunables that act alike, with what to do about it."""
    smooth = [(each.name, _slopes(each)) for each in findings if each.verdict is Verdict.SMOOTH]
    straight = [(name, slopes) for name, slopes in smooth if slopes is not None]
    return tuple(
        f"{first} and {second} act alike on the fitness of all controllers of the check (cosine {cosine:.2f}), so that "
        "fitness hardly tells them apart, however many samples there are. Tune one of the two, or tune on readings"
        for (first, one), (second, other) in combinations(straight, 2)
        if (cosine := _cosine(one, other)) >= ALIKE
    )


def _slopes(found: Sensitivity) -> FloatArray | None:
    """Return the slopes of a profile, `(c,)`, nan where physics failed; None if lines explain too little of it."""
    fitness = np.array(found.fitness, dtype=float)
    across = np.linspace(-0.5, 0.5, fitness.shape[1])
    centred = fitness - fitness.mean(axis=1, keepdims=True)
    slopes = (centred * across).sum(axis=1) / (across * across).sum()
    known = np.isfinite(slopes)
    whole = float((centred[known] ** 2).sum())
    lines = float((slopes[known] ** 2).sum() * (across * across).sum())
    return slopes if known.sum() >= FEWEST and lines >= STRAIGHT * whole > 0 else None


def _cosine(one: FloatArray, other: FloatArray) -> float:
    known = np.isfinite(one) & np.isfinite(other)
    lengths = float(np.linalg.norm(one[known]) * np.linalg.norm(other[known]))
    return abs(float(one[known] @ other[known])) / lengths if known.sum() >= FEWEST and lengths > 0 else 0.0
