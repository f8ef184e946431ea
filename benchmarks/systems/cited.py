"""Checks of the systems that the paper cites, and of trial and error on a repertoire."""

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from scipy import stats

from benchmarks.systems.judging import DESK, Arm, Claim, Spec, above, check, not_above
from benchmarks.systems.rows import compared
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.loop import belief_of, repetition
from gaplab.services.core.optimizers.nsga2 import fronts
from gaplab.services.core.strategies.transferability import Objectives, Transferability
from gaplab.services.core.types import Step, Transferred
from gaplab.services.specs.assembly import reality_of, setting

# Back-to-Reality

ROUND = 5
"""Real-world evaluations of a round: a sample and four trials, the default."""


@check(
    back_to_reality=DESK
    | {
        "strategies": [
            "back_to_reality",
            {"name": "back_to_reality", "options": {"learn_from_trials": True}},
        ],
        "discrepancy": "absolute_fitness",
        "iterations": 3 * ROUND + 1,
    },
    back_to_reality_fit=compared("inside", "simulated fit"),
)
def back_to_reality(back_to_reality: list[Arm], back_to_reality_fit: list[Arm]) -> Iterator[Claim]:
    """Judge what Zagal and Ruiz-del-Solar say, and what Klaus et al. expect of it."""
    (plain, taught), (fit,) = back_to_reality, back_to_reality_fit
    begins = (1, 1 + 3 * ROUND)
    gaps = [np.abs(plain.measured(at) - plain.simulated(*_selected(plain, at))) for at in begins]
    yield above("the gap of L1's best halves within three rounds", gaps[0] / 2, gaps[1])
    for says, of in (("recorded", Arm.recorded), ("transferred alone", lambda arm, at: arm.measured(at, "probe"))):
        first, second, third = (of(arm, 10) for arm in (fit, plain, taught))
        yield above(f"after ten evaluations it is below simulated fit ({says})", first, second)
        yield above(f"to learn from trials narrows that ({says})", third, second)


def _selected(arm: Arm, iteration: int) -> tuple[FloatArray, FloatArray]:
    """Return the sample of an iteration and the simulator in which it was evolved, of each repetition."""
    return arm.genomes(range(iteration, iteration + 1))[:, 0], arm.simulator(iteration - 1)


# Sequential surrogate optimization


@check(
    surrogate_toy=DESK
    | {"strategies": ["surrogate", "direct"], "robot": "toy_function", "engine": "analytic", "repetitions": 20},
    surrogate=compared(
        *("inside", "surrogate of reality", "known fit", "simulated fit"),
        *("fit unless near", "surrogate of the residual", "direct"),
    ),
)
def surrogate(surrogate_toy: list[Arm], surrogate: list[Arm]) -> Iterator[Claim]:
    """Judge what Hemker et al. say of few parameters, and what is expected of 24."""
    toy, toy_direct = surrogate_toy
    best = 0.95 * toy_direct.measured(0, "probe")
    yield above("of one gene, surrogate reaches 0.95 of direct within ten evaluations", toy.recorded(10), best)
    kriging, known, fit, unless_near, residual, direct = surrogate
    yield not_above("of 24 genes, surrogate does not beat known fit", kriging.recorded(10), known.recorded(10))
    says = "fit unless near spreads its samples more than simulated fit"
    yield above(says, _spread(unless_near), _spread(fit), unit="extents")
    margin = 0.05 * float(np.nanmean(direct.measured(0, "probe")))
    for name, arm in (("fit unless near", unless_near), ("residual", residual)):
        says = f"{name} is less fit than simulated fit by less than 0.05 of direct"
        yield above(says, arm.recorded(10), fit.recorded(10), least=-margin)


def _spread(arm: Arm) -> FloatArray:
    """Return `(r,)`: the mean distance of pairs of samples, in units of the extents."""
    genomes, space = arm.genomes(range(1, 11)), arm.robot.space
    away = np.linalg.norm(space.apart(genomes[:, :, None], genomes[:, None]), axis=-1)
    count = genomes.shape[1]
    return np.asarray(away.sum(axis=(1, 2)) / (count * (count - 1)))


# Intelligent trial and error

CONTACTS: Spec = {"name": "walk", "options": {"sensors": "contacts", "every_s": 0.02}}
BY_CONTACTS: Spec = {"name": "intelligent_trial_and_error", "preset": "cully_2015"}
BY_TILT = "intelligent_trial_and_error"
REPERTOIRE: Spec = {"preset": "desk", "controller_evaluations": 2_000, "selection_evaluations": 700}
"""A repertoire is made once, so that it may cost as much as four searches at desk scale."""


@check(
    trial_and_error=DESK | {"strategies": [BY_CONTACTS], "task": CONTACTS, "budget": REPERTOIRE},
    trial_and_error_tilt=DESK | {"strategies": [BY_TILT], "budget": REPERTOIRE},
    trial_and_error_fit=compared("inside", "simulated fit"),
)
def trial_and_error(
    trial_and_error: list[Arm], trial_and_error_tilt: list[Arm], trial_and_error_fit: list[Arm]
) -> Iterator[Claim]:
    """Judge what Cully et al. say, and that tuning wins where reality is within the simulators' span."""
    (contacts,), (tilt,), (fit,) = trial_and_error, trial_and_error_tilt, trial_and_error_fit
    for described, arm in (("contacts", contacts), ("tilt", tilt)):
        says = f"within ten trials it measures 0.9 of the repertoire's best in reality ({described})"
        tried = np.fmax.reduce([arm.measured(number) for number in range(1, 11)])
        yield above(says, tried, 0.9 * _best_of_repertoire(arm))
        says = f"after ten samples, simulated fit, which tunes, is fitter ({described})"
        yield above(says, fit.recorded(10), arm.recorded(10))


def _best_of_repertoire(arm: Arm) -> FloatArray:
    """Return `(r,)`: the best fitness in reality of a member of each repertoire, which follows from the spec alone."""
    truth, reality = reality_of(arm.spec, arm.robot)
    best = []
    for number in sorted(arm.samples["repetition"].unique()):
        _, transferred = islice(repetition(setting(arm.spec, int(number))), 2)
        assert isinstance(transferred, Transferred)
        best.append(np.nanmax(reality(transferred.members, truth[None])))
    return np.array(best)


# Transferability


@check(
    transferability=DESK
    | {"strategies": [{"name": "transferability", "preset": "as_published"}], "reality": {"engine": "physx"}},
    transferability_outside=compared("outside", "transferability", "simulated fit", "direct"),
    transferability_inside=compared("inside", "transferability", "simulated fit"),
)
def transferability(
    transferability: list[Arm], transferability_outside: list[Arm], transferability_inside: list[Arm]
) -> Iterator[Claim]:
    """Judge what Koos et al. say, and that tuning wins where reality is within the simulators' span, not beyond."""
    (published,), (plain, fit, direct) = transferability, transferability_outside
    inside, inside_fit = transferability_inside
    best = direct.measured(0, "probe")
    margin = 0.05 * float(np.nanmean(best))
    for says, of in (("recorded", Arm.recorded), ("transferred alone", lambda arm, at: arm.measured(at, "probe"))):
        found = of(plain, 10)
        yield above(f"ten tests suffice for 0.85 of direct in another engine ({says})", found, 0.85 * best)
        yield above(f"that is more than the untuned simulator's fittest ({says})", found, plain.measured(0, "probe"))
        yield above(f"exponent and divisor do not matter ({says})", of(published, 10), found, least=-margin)
        yield above(f"in another engine it is fitter than simulated fit, which tunes ({says})", found, of(fit, 10))
        yield above(f"within the span, simulated fit is fitter ({says})", of(inside_fit, 10), of(inside, 10))
    correlations = np.array([_correlation(plain.spec, number, log) for number, log in enumerate(plain.logs)])
    says = "estimates rank the disparities of untested members of the front, correlation above 0.5"
    yield above(says, correlations, np.zeros(len(correlations)), least=0.5, unit="")


def _correlation(spec: ResolvedSpec, number: int, log: Sequence[Step]) -> float:
    """Return the rank correlation of estimated and measured disparity over untested members of the last front."""
    found, strategy = setting(spec, number), Transferability()
    belief = belief_of(found, found.history(log))
    objectives = Objectives(belief, strategy.options)
    assert found.sense is not None
    outcomes = found.sense(objectives.start, belief.parameters[:1])
    scores, tested = objectives(objectives.start, outcomes), {sample.genome.tobytes() for sample in belief.samples}
    untested = np.array([genome.tobytes() not in tested for genome in objectives.start])
    front = np.flatnonzero(untested & np.isfinite(scores).all(axis=1))
    front = front[fronts(scores[front]) == 0]
    real = [found.reality(genome).readings for genome in objectives.start[front]]
    disparities = [objectives.disparity(seen, felt) for seen, felt in zip(outcomes[front, 0, 1:], real, strict=True)]
    return float(stats.spearmanr(-scores[front, 1], disparities, nan_policy="omit").statistic)
