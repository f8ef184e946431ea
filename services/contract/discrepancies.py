"""The contract of a discrepancy."""

from functools import partial

import numpy as np

from gaplab.services.contract.promises import check_repeats
from gaplab.services.core.arrays import NO_READINGS, FloatArray, Outcomes, frozen
from gaplab.services.core.discrepancies.base import Discrepancy

READINGS = 6
TIMES_S = frozen(np.linspace(0.25, 1.5, READINGS))
Plugin = type[Discrepancy]


def answers(plugin: Plugin, samples: int = 4, simulators: int = 5, seed: int = 6) -> tuple[Outcomes, FloatArray]:
    """Return outcomes in simulation `(n, m, 1 + q)` and in reality `(n, 1 + q)`; q is 0 unless it `senses`."""
    rng = np.random.default_rng(seed)
    size = 1 + (READINGS if plugin.senses else 0)
    return rng.normal(size=(samples, simulators, size)), rng.normal(size=(samples, size))


def terms(discrepancy: Discrepancy, simulated: Outcomes, measured: FloatArray) -> FloatArray:
    """Return the terms `(n, m)` of a discrepancy, which is given read-only arrays."""
    return np.asarray(discrepancy.terms(frozen(simulated), frozen(measured), _times_s(discrepancy)))


def residuals(discrepancy: Discrepancy, simulated: Outcomes, measured: FloatArray) -> FloatArray:
    """Return the residuals `(n, m, r)` of a discrepancy, which is given read-only arrays."""
    return np.asarray(discrepancy.residuals(frozen(simulated), frozen(measured), _times_s(discrepancy)))


def _times_s(discrepancy: Discrepancy) -> FloatArray:
    return TIMES_S if discrepancy.senses else NO_READINGS


def gives_a_term_for_each_sample_and_simulator(plugin: Plugin) -> None:
    """Gives a number of at least 0 for each sample and simulator."""
    simulated, measured = answers(plugin)
    found = terms(plugin(), simulated, measured)
    assert found.shape == (4, 5), f"of 4 samples in 5 simulators it returns an array of shape {found.shape}"
    assert (found >= 0).all(), f"its least term is {found.min()}; permitted: at least 0"


def is_zero_where_nothing_differs(plugin: Plugin) -> None:
    """Is 0 for a simulator that answers as reality did, and above 0 for one that does not."""
    simulated, measured = answers(plugin)
    same = terms(plugin(), np.repeat(measured[:, None, :], 5, axis=1), measured)
    assert (same == 0).all(), f"for the right simulator it is {same.max()}"
    assert (terms(plugin(), simulated, measured) > 0).all(), "it is 0 for a simulator that differs"


def judges_each_simulator_by_itself(plugin: Plugin) -> None:
    """Judges each sample in each simulator by itself, whatever else is in the call."""
    simulated, measured = answers(plugin)
    together = terms(plugin(), simulated, measured)
    alone = terms(plugin(), simulated[1:2, 2:3], measured[1:2])[0, 0]
    assert alone == together[1, 2], f"a term is {together[1, 2]} in a large call, and {alone} alone"


def says_where_the_physics_failed(plugin: Plugin) -> None:
    """Is nan where the physics failed, and there alone."""
    simulated, measured = answers(plugin)
    simulated[2, 3] = np.nan
    failed = np.isnan(terms(plugin(), simulated, measured))
    assert failed[2, 3], "it is a number although the physics failed"
    assert failed.sum() == 1, "it is nan in simulators whose physics did not fail"


def copes_with_a_failed_sensor(plugin: Plugin) -> None:
    """Copes with readings in reality that are nan, because a sensor failed."""
    simulated, measured = answers(plugin)
    measured[1, 1:] = np.nan
    assert np.isfinite(terms(plugin(), simulated, measured)).all(), "a reading of nan makes a term nan"


def has_residuals_whose_squares_are_its_terms(plugin: Plugin) -> None:
    """Has residuals whose squares sum to its terms, if it says `squares`."""
    if not plugin.squares:
        return
    simulated, measured = answers(plugin)
    squares = (residuals(plugin(), simulated, measured) ** 2).sum(axis=-1)
    assert np.allclose(squares, terms(plugin(), simulated, measured)), "the squares of its residuals are not its terms"


def repeats_itself(plugin: Plugin) -> None:
    """Gives the same terms for the same outcomes, whatever it compared before."""
    questions = {}
    for seed in (6, 7):
        simulated, measured = answers(plugin, seed=seed)
        questions[f"a term of outcomes {seed}"] = partial(terms, simulated=simulated, measured=measured)
        if plugin.squares:
            questions[f"a residual of outcomes {seed}"] = partial(residuals, simulated=simulated, measured=measured)
    check_repeats(plugin, questions, "use no random numbers, and keep nothing from one call for the next")
