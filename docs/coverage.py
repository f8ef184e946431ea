"""How often 95 % intervals contain the truth, and what is called identified is right, also where the model is wrong.

`python -m docs.coverage --realities 24 --samples 5 15` draws realities of the quadruped in MuJoCo: between the
bounds of the simulators, with a restitution at its bound, and with what no simulator has. Each is tuned on random
samples with the noise of the sensors. It prints a row for each kind, as they end.
"""

from argparse import ArgumentParser
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from rich.console import Console

from gaplab.schemas.misfit import Identification
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.discrepancies.readings import Readings
from gaplab.services.core.linear_models import fit_of, widened
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.space import Space
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuners.gauss_newton import GaussNewton
from gaplab.services.core.tuning import Misfit
from gaplab.services.core.types import Sample
from gaplab.services.engines import engines
from gaplab.services.findings.identification import Means, verdicts
from gaplab.services.findings.misfit import Doubt, Tuning, doubt, misfit_point
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.tunables.labels import tunable_of

TUNABLES = {"dynamic_friction": (0.0, 1.5), "restitution": (0.0, 0.6), "motor_gain": (0.3, 3.0)}
SPACE = Space.box(*zip(*TUNABLES.values(), strict=True))
NAMES = list(TUNABLES)

BEYOND = {
    "inside": {},
    "restitution 0": {},
    "slope of 3°": {"slope": np.radians(3.0)},
    "one weak knee": {"motor_gain(front_left_knee)": 0.4},
    "legs 10 % longer": {"length_scale": 1.1},
    "trunk half as heavy again": {"mass(trunk)": 1.5},
}
"""What each kind of reality has and no simulator."""

ROBOT = Quadruped()


def tuned(kind: str, samples: int, seed: int) -> tuple[FloatArray, Tuning]:
    """Return a drawn truth `(p,)`, and the simulator that was tuned on samples of that reality."""
    rng, engine = np.random.default_rng([2026, seed]), engines.create(PluginRef(name="mujoco"))
    edits = [tunable_of(name) for name in NAMES]
    truth = SPACE.draw(1, rng)[0]
    if kind == "restitution 0":
        truth[1] = 0.0
    more = BEYOND[kind]
    real = Simulation(ROBOT, engine, [*edits, *map(tunable_of, more)])
    genomes = ROBOT.space.draw(samples, rng)
    seen = real.sense(genomes, np.array([[*truth, *more.values()]]))[:, 0]
    seen[:, 1:] += rng.normal(size=seen[:, 1:].shape)
    measured = [Sample(genome, float(row[0]), frozen(row[1:])) for genome, row in zip(genomes, seen, strict=True)]
    simulation = Simulation(ROBOT, engine, edits)
    answers = Answers(simulation, sense=simulation.sense, periods=ROBOT.sensors.reading_periods)
    misfit = Misfit(answers, measured, Readings(), ROBOT.sensors.reading_times_s)
    (best,) = GaussNewton().tune(TuningTask(misfit, SPACE, SteadyState(), 1, 60, ()), rng)
    fit = fit_of(best, misfit, SPACE, rng)
    assert best.interval is not None
    wide = best.interval if fit is None else widened(best.interval, best.parameters, fit.interval_scale, SPACE)
    found = Tuning(best.parameters, best.squared_error, samples, np.nan, np.nan, interval=wide, fit=fit)
    return truth, replace(found, discrepancy=Readings())


def row(kind: str, samples: int, realities: Sequence[int]) -> str:
    """Return one row of the table."""
    inside, identified, surprised = [], [], 0
    for seed in realities:
        truth, found = tuned(kind, samples, seed)
        assert found.interval is not None
        doubted = doubt([found], simulated=False)
        point = misfit_point(samples, [found], NAMES, SPACE)
        told = verdicts([point], [samples], Means(), doubted)
        inside.append((found.interval[:, 0] <= truth) & (truth <= found.interval[:, 1]))
        identified.append([each.verdict is Identification.IDENTIFIED for each in told])
        surprised += doubted is Doubt.WRONG
    within, called = np.array(inside), np.array(identified)
    shares = "  ".join(f"{share:4.0%}" for share in within.mean(axis=0))
    said = f"{(within & called).sum():3} of {called.sum():3} identified are right; {surprised} unreproduced"
    return f"{kind:25} {samples:3} samples of {len(realities)}: {within.mean():4.0%} covered ({shares}); {said}"


def main() -> None:
    """Print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--realities", type=int, default=24)
    parser.add_argument("--samples", type=int, nargs="+", default=[5, 15])
    parser.add_argument("--first", type=int, default=0, help="number of the first reality")
    given = parser.parse_args()
    for samples in given.samples:
        for kind in BEYOND:
            told = row(kind, samples, range(given.first, given.first + given.realities))
            Console().print(told, highlight=False, soft_wrap=True)


if __name__ == "__main__":
    main()
