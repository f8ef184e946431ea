"""Checks of later systems, of interleaved evolution, and of controllers that adapt."""

from collections.abc import Iterator

import numpy as np

from benchmarks.systems.judging import DESK, Arm, Claim, Spec, above, check
from benchmarks.systems.rows import SETTINGS, compared
from gaplab.services.core.arrays import FloatArray

# SimOpt


@check(
    simopt=compared("inside", "SimOpt"),
    simopt_search=DESK | SETTINGS["simopt"] | {"tuner": "search", "strategies": ["simulated_fit"]},
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


@check(bayrn=compared("inside", "BayRn", "simulated fit", "domain randomization"))
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


@check(
    interleaved=DESK | SETTINGS["turns"] | {"strategies": ["simulated_fit_and_informative"]},
    interleaved_turns=compared("inside", "interleaved evolution", "direct"),
    interleaved_anew=compared("inside", "simulated fit and informative"),
)
def interleaved(interleaved: list[Arm], interleaved_turns: list[Arm], interleaved_anew: list[Arm]) -> Iterator[Claim]:
    """Judge what the paper expects of its future work: as fit controllers for fewer evaluations."""
    (small,), (turns, direct), (large,) = interleaved, interleaved_turns, interleaved_anew
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


FRICTION, SHIN = "dynamic_friction", "length_scale(front_left_shin, what=places)"
AS_EVOLVED = {FRICTION: 0.8, SHIN: 1.0}


def _walks(controller: str, **changes: float) -> Spec:
    """Return a study in which a controller evolves in one simulator, and is tried where some of it differs."""
    return ONE | {
        "strategies": ONE["strategies"][:1],
        "controller": controller,
        "tunables": [{"name": name, "lower": at - 0.001, "upper": at + 0.001} for name, at in AS_EVOLVED.items()],
        "reality": {"parameters": AS_EVOLVED | changes},
    }


@check(
    anticipating=_walks("anticipating"),
    anticipating_slips=_walks("anticipating", **{FRICTION: 0.4}),
    anticipating_limps=_walks("anticipating", **{SHIN: 1.2}),
    open_loop=_walks("square_pulses"),
    open_loop_slips=_walks("square_pulses", **{FRICTION: 0.4}),
    open_loop_limps=_walks("square_pulses", **{SHIN: 1.2}),
)
def anticipating(**studies: list[Arm]) -> Iterator[Claim]:
    """Judge what Hartland and Bredeche say: anticipation recovers from what simulation did not have."""
    real = {name: arm.measured(0, "probe") for name, (arm,) in studies.items()}
    for says, where in (("on half the friction", "slips"), ("with one shin a fifth longer", "limps")):
        open_loop, found = (real[name] - real[f"{name}_{where}"] for name in ("open_loop", "anticipating"))
        yield above(f"{says} it loses at most half of what open loop loses", open_loop / 2, found)
