"""Whether each system from elsewhere does here what its authors say: `python -m benchmarks.systems NAME …`.

Each check is a few studies at desk scale, and claims that are judged on them. A study is read from the folder of
studies if it is there as an archive, or else computed and kept there; an interrupted one goes on. `--smoke` tries the
studies at a size that shows nothing.

A claim holds if the 90 % interval of its difference is on its side of 0, fails if that is on the other side, and is
open otherwise. Repetitions are the unit; the interval is Welch's.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

import gaplab
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.loop import repetition
from gaplab.services.core.optimizers.nsga2 import fronts
from gaplab.services.core.strategies.transferability import Objectives, Transferability
from gaplab.services.core.types import Belief, Step, Transferred
from gaplab.services.specs.assembly import reality_of, setting, simulation_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries.experiments import repetitions_of
from gaplab.services.store.queries.logs import logs
from gaplab.services.world.robots.base import Robot

if TYPE_CHECKING:
    import pandas

Spec = dict[str, Any]

FOLDER = Path(__file__).parents[1] / "docs" / "studies"
DESK: Spec = {"robot": "quadruped", "engine": "mujoco", "budget": "desk", "iterations": 10, "repetitions": 10}
SMOKE: Spec = {"budget": "smoke", "repetitions": 2, "direct_repetitions": 2}


@dataclass(frozen=True)
class Claim:
    """What the authors say, what was found, and whether it holds; None if that is open."""

    says: str
    found: str
    holds: bool | None

    def __str__(self) -> str:
        verdict = {True: "holds", False: "does not hold", None: "open"}[self.holds]
        return f"{verdict.upper()}: {self.says}\n  {self.found}"


def above(says: str, first: FloatArray, second: FloatArray, least: float = 0.0, unit: str = "m/s") -> Claim:
    """Return the claim that the mean of one is above that of the other by `least`; each `(r,)` by repetition."""
    away = _difference(first, second)
    means = f"{np.nanmean(first):.3f} and {np.nanmean(second):.3f} {unit}, n = {len(first)} and {len(second)}"
    found = f"{means}; difference {away[0]:.3f} ({away[1]:.3f} to {away[2]:.3f})" + (
        f"; limit {least:.3f}" * bool(least)
    )
    return Claim(says, found, True if away[1] > least else False if away[2] < least else None)


def not_above(says: str, first: FloatArray, second: FloatArray) -> Claim:
    """Return the claim that the mean of one is not shown to be above that of the other."""
    claim = above(says, first, second)
    return Claim(says, claim.found, claim.holds is not True)


def _difference(first: FloatArray, second: FloatArray) -> tuple[float, float, float]:
    """Return the difference of two means and the ends of its 90 % interval; nan is left out."""
    kept = [each[np.isfinite(each)] for each in (first, second)]
    lower, upper = stats.ttest_ind(*kept, equal_var=False).confidence_interval(0.9)
    return float(kept[0].mean() - kept[1].mean()), float(lower), float(upper)


@dataclass(frozen=True)
class Arm:
    """One experiment of a study; repetitions and genes are in the order of the tables, logs in that of repetitions."""

    spec: ResolvedSpec
    samples: "pandas.DataFrame"
    simulators: "pandas.DataFrame"
    logs: Sequence[Sequence[Step]]

    def measured(self, iteration: int, kind: str = "sample") -> FloatArray:
        """Return the real fitness `(r,)` of one sample, or one transferred controller ("probe")."""
        rows = self.samples[(self.samples["iteration"] == iteration) & (self.samples["kind"] == kind)]
        return np.asarray(rows.sort_values("repetition")["fitness"], dtype=np.float64)

    def recorded(self, evaluations: int) -> FloatArray:
        """Return `(r,)`: the larger fitness of the transferred controller and the best sample so far."""
        every = [self.measured(number) for number in range(1, evaluations + 1)]
        return np.asarray(np.fmax.reduce([self.measured(evaluations, "probe"), *every]))

    def genomes(self, iterations: range) -> FloatArray:
        """Return the samples of these iterations, `(r, k, g)`."""
        rows = self.samples[(self.samples["kind"] == "sample") & self.samples["iteration"].isin(iterations)]
        genes = rows.sort_values(["repetition", "iteration"]).filter(regex="^gene_").to_numpy(dtype=np.float64)
        return np.asarray(genes.reshape(-1, len(iterations), genes.shape[1]))

    def simulator(self, iteration: int) -> FloatArray:
        """Return the best simulator of each repetition after an iteration, `(r, p)`."""
        rows = self.simulators[(self.simulators["iteration"] == iteration) & (self.simulators["rank"] == 0)]
        names = [each.name for each in self.spec.tunables]
        return np.asarray(rows.sort_values("repetition")[names], dtype=np.float64)

    @cached_property
    def robot(self) -> Robot:
        """Return what is simulated."""
        return robot_of(self.spec)

    def simulated(self, genomes: FloatArray, simulators: FloatArray) -> FloatArray:
        """Return the fitness `(r,)` of each genome `(r, g)` in its own simulator `(r, p)`."""
        simulation = simulation_of(self.spec, self.robot)
        pairs = zip(genomes, simulators, strict=True)
        return np.array([simulation(genome[None], simulator[None])[0, 0] for genome, simulator in pairs])


@dataclass(frozen=True)
class System:
    """The check of a system.

    Attributes:
        studies: their specs, by label.
        judge: returns the claims, given the experiments of each study, in the order of its strategies.
    """

    studies: Mapping[str, Spec]
    judge: Callable[..., Iterator[Claim]]

    def claims(self, folder: Path, changes: Spec) -> Iterator[Claim]:
        """Yield the claims, judged; studies that are missing in the folder are computed, with these changes."""
        yield from self.judge(**{label: arms(label, spec | changes, folder) for label, spec in self.studies.items()})


def arms(label: str, spec: Spec, folder: Path) -> list[Arm]:
    """Return the experiments of a study, in the order of its strategies, from its archive or by computing it."""
    name = f"system-{label.replace('_', '-')}"
    archive, database = folder / f"{name}.zip", folder / f"{name}.db"
    if archive.exists():
        result = gaplab.run(archive)
    else:
        result = gaplab.run(database if database.exists() else {"name": name, "seed": 2026} | spec, path=database)
        result.save(archive)
    samples, simulators = result.samples, result.simulators
    with result._store.reading() as session:
        ids = {each.id: [row.id for row in repetitions_of(session, each.id)] for each in result.study.experiments}
        steps = {id_: [logs(session, [row])[row] for row in rows] for id_, rows in ids.items()}
    return [
        Arm(
            spec_of(each.spec),
            samples[samples["experiment"] == each.id],
            simulators[simulators["experiment"] == each.id],
            steps[each.id],
        )
        for each in result.study.experiments
    ]


SYSTEMS: dict[str, System] = {}


def check(**studies: Spec) -> Callable[[Callable[..., Iterator[Claim]]], Callable[..., Iterator[Claim]]]:
    """Register a function as the check of the system with its name, on these studies."""

    def register(judge: Callable[..., Iterator[Claim]]) -> Callable[..., Iterator[Claim]]:
        SYSTEMS[judge.__name__] = System(studies, judge)
        return judge

    return register


# Back-to-Reality

ROUND = 5
"""Real-world evaluations of a round: a sample and four trials, the default."""


@check(
    back_to_reality=DESK
    | {
        "strategies": [
            "back_to_reality",
            {"name": "back_to_reality", "options": {"learn_from_trials": True}},
            "simulated_fit",
        ],
        "discrepancy": "absolute_fitness",
        "iterations": 3 * ROUND + 1,
    }
)
def back_to_reality(back_to_reality: list[Arm]) -> Iterator[Claim]:
    """Judge what Zagal and Ruiz-del-Solar say, and what Klaus et al. expect of it."""
    plain, taught, fit = back_to_reality
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
    surrogate=DESK
    | {"strategies": ["surrogate", "known_fit", "simulated_fit", "fit_unless_near", "residual", "direct"]},
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
    trial_and_error_fit=DESK | {"strategies": ["simulated_fit"]},
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
    | {
        "strategies": [
            "transferability",
            {"name": "transferability", "preset": "as_published"},
            "simulated_fit",
            "direct",
        ],
        "reality": {"engine": "physx"},
    },
    transferability_inside=DESK | {"strategies": ["transferability", "simulated_fit"]},
)
def transferability(transferability: list[Arm], transferability_inside: list[Arm]) -> Iterator[Claim]:
    """Judge what Koos et al. say, and that tuning wins where reality is within the simulators' span, not beyond."""
    plain, published, fit, direct = transferability
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
    history = found.history(log)
    belief = Belief(
        found.genomes,
        found.known,
        history.samples,
        history.simulators,
        found.parameters,
        found.names,
        members=history.members,
        reading_times_s=found.reading_times_s,
        reading_periods=found.reading_periods,
    )
    objectives = Objectives(belief, strategy.options)
    assert found.sense is not None
    outcomes = found.sense(objectives.start, belief.parameters[:1])
    scores, tested = objectives(objectives.start, outcomes), {sample.genome.tobytes() for sample in history.samples}
    untested = np.array([genome.tobytes() not in tested for genome in objectives.start])
    front = np.flatnonzero(untested & np.isfinite(scores).all(axis=1))
    front = front[fronts(scores[front]) == 0]
    real = [found.reality(genome).readings for genome in objectives.start[front]]
    disparities = [objectives.disparity(seen, felt) for seen, felt in zip(outcomes[front, 0, 1:], real, strict=True)]
    return float(stats.spearmanr(-scores[front, 1], disparities, nan_policy="omit").statistic)


# SimOpt

SENSED: Spec = DESK | {"discrepancy": {"name": "readings", "options": {"absolute_weight": 0.5}}}


@check(
    simopt=SENSED
    | {
        "strategies": [{"name": "weighted", "preset": "chebotar_2019"}],
        "tuner": "simopt",
        "budget": {"preset": "desk", "simulator_evaluations": 620},
    },
    simopt_search=SENSED
    | {"strategies": ["simulated_fit"], "budget": {"preset": "desk", "simulator_evaluations": 620}},
)
def simopt(simopt: list[Arm], simopt_search: list[Arm]) -> Iterator[Claim]:
    """Judge what Chebotar et al. say: a few iterations suffice, and beat the distribution that one begins with."""
    (gaussian,), (search,) = simopt, simopt_search
    yield above(
        "three iterations transfer better than the first distribution, domain randomization",
        gaussian.measured(3, "probe"),
        gaussian.measured(0, "probe"),
    )
    says = "the mean is nearer the truth after three samples than after one"
    yield above(says, _away(gaussian, 1), _away(gaussian, 3), unit="of the bounds")
    yield above(
        "the search of the paper on the same readings is nearer, or as near, after three",
        _away(gaussian, 3),
        _away(search, 3),
        least=-0.05,
        unit="of the bounds",
    )
    yield above(
        "after ten samples its transfer is fitter than that of one simulator, tuned by search",
        gaussian.measured(10, "probe"),
        search.measured(10, "probe"),
    )


def _away(arm: Arm, iteration: int) -> FloatArray:
    """Return `(r,)`: the mean distance of the tunables of the best simulator from the truth, in units of the bounds."""
    truth = np.array(list(arm.spec.reality.parameters.values()))
    extent = np.array([each.upper - each.lower for each in arm.spec.tunables])
    return np.asarray((np.abs(arm.simulator(iteration) - truth) / extent).mean(axis=1))


# Bayesian domain randomization


@check(
    bayrn=DESK
    | {
        "strategies": ["bayrn", "simulated_fit", "domain_randomization"],
        "budget": {"preset": "desk", "reuse_transfer": True},
    }
)
def bayrn(bayrn: list[Arm]) -> Iterator[Claim]:
    """Judge what Muratore et al. say, and that tuning wins where reality is among the simulators."""
    learned, tuned, randomized = bayrn
    yield above(
        "within ten samples it beats domain randomization", learned.recorded(10), randomized.measured(0, "probe")
    )
    first = [learned.measured(number) for number in (1, 2, 3)]
    later = [learned.measured(number) for number in (8, 9, 10)]
    yield above(
        "its last three samples are fitter than its three first, of random simulators",
        np.mean(later, axis=0),
        np.mean(first, axis=0),
    )
    yield above(
        "simulated fit, which finds reality among the simulators, is fitter", tuned.recorded(10), learned.recorded(10)
    )


# Interleaved evolution

IN_TURN: Spec = {
    "preset": "desk",
    "controller_evaluations": 100,
    "selection_evaluations": 100,
    "simulator_evaluations": 50,
}
WARM: Spec = {"name": "search", "options": {"warm_start": True}}


@check(
    interleaved=DESK
    | {"strategies": ["interleaved", "simulated_fit_and_informative", "direct"], "budget": IN_TURN, "tuner": WARM},
    interleaved_anew=DESK | {"strategies": ["simulated_fit_and_informative"]},
)
def interleaved(interleaved: list[Arm], interleaved_anew: list[Arm]) -> Iterator[Claim]:
    """Judge what the paper expects of its future work: as fit controllers for fewer evaluations."""
    (turns, small, direct), (large,) = interleaved, interleaved_anew
    margin = 0.05 * float(np.nanmean(direct.measured(0, "probe")))
    for says, of in (("recorded", Arm.recorded), ("transferred alone", lambda arm, at: arm.measured(at, "probe"))):
        first, second, third = (of(arm, 10) for arm in (turns, small, large))
        yield above(f"after ten samples it is fitter than searches of its size that start anew ({says})", first, second)
        yield above(
            f"it is less fit than those of the desk's size by less than 0.05 of direct ({says})",
            first,
            third,
            least=-margin,
        )


# Controllers that adapt

ONE: Spec = DESK | {
    "strategies": [{"name": "domain_randomization", "options": {"simulators": 1}}, "direct"],
    "repetitions": 20,
}


@check(
    plastic=ONE | {"controller": {"name": "plastic", "options": {"base": "none"}}},
    plastic_fixed=ONE | {"controller": "mlp"},
)
def plastic(plastic: list[Arm], plastic_fixed: list[Arm]) -> Iterator[Claim]:
    """Judge what Floreano and Urzelai say: plastic networks transfer from one simulator better than fixed weights."""
    adapts, fixed = (_share_of_direct(*each) for each in (plastic, plastic_fixed))
    yield above("plastic networks keep more of direct than networks of fixed weights", adapts, fixed, unit="of direct")


def _share_of_direct(arm: Arm, direct: Arm) -> FloatArray:
    return arm.measured(0, "probe") / float(np.nanmean(direct.measured(0, "probe")))


FRICTION, SLIPPERY = 0.8, 0.4


def _walks(controller: str, friction: float) -> Spec:
    """Return a study in which a controller evolves with one friction, and is tried with another."""
    narrow = {"name": "dynamic_friction", "lower": FRICTION - 0.001, "upper": FRICTION + 0.001}
    reality = {"parameters": {"dynamic_friction": friction}}
    return ONE | {
        "strategies": ONE["strategies"][:1],
        "controller": controller,
        "tunables": [narrow],
        "reality": reality,
    }


@check(
    anticipating=_walks("anticipating", FRICTION),
    anticipating_slips=_walks("anticipating", SLIPPERY),
    open_loop=_walks("square_pulses", FRICTION),
    open_loop_slips=_walks("square_pulses", SLIPPERY),
)
def anticipating(
    anticipating: list[Arm], anticipating_slips: list[Arm], open_loop: list[Arm], open_loop_slips: list[Arm]
) -> Iterator[Claim]:
    """Judge what Hartland and Bredeche say: anticipation recovers from what simulation did not have."""
    pairs = ((anticipating, anticipating_slips), (open_loop, open_loop_slips))
    losses = [before[0].measured(0, "probe") - after[0].measured(0, "probe") for before, after in pairs]
    yield above("on half the friction it loses at most half of what open loop loses", losses[1] / 2, losses[0])


def main() -> None:
    """Print the claims of the systems that are named, or of all."""
    parser = ArgumentParser(prog="python -m benchmarks.systems", description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(SYSTEMS)}; default: all")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of the studies; default: docs/studies")
    parser.add_argument("--smoke", action="store_true", help="try the studies at a tiny size; name another folder too")
    arguments = parser.parse_args()
    if unknown := set(arguments.names) - set(SYSTEMS):
        parser.error(f"no system is called {', '.join(sorted(unknown))}")
    for name in arguments.names or SYSTEMS:
        print(f"{name}:")
        for claim in SYSTEMS[name].claims(arguments.folder, SMOKE if arguments.smoke else {}):
            print(claim)


if __name__ == "__main__":
    main()
