"""Claims about systems, the studies that they are judged on, and how."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

import gaplab
from benchmarks.kept import kept
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.types import Step
from gaplab.services.specs.assembly import simulation_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries.experiments import repetitions_of
from gaplab.services.store.queries.logs import logs
from gaplab.services.world.robots.base import Robot

if TYPE_CHECKING:
    import pandas

Spec = dict[str, Any]

FOLDER = Path(__file__).parents[2] / "docs" / "studies"
DESK: Spec = {"robot": "quadruped", "engine": "mujoco", "budget": "desk", "iterations": 10, "repetitions": 10}
SMOKE: Spec = {"budget": {"preset": "smoke", "controller_evaluations": 400}, "repetitions": 2, "direct_repetitions": 2}


@dataclass(frozen=True)
class Claim:
    """What the authors say, what was found, and whether it holds; None if that is open."""

    says: str
    found: str
    holds: bool | None

    @property
    def verdict(self) -> str:
        """Return whether it holds, in words."""
        return {True: "holds", False: "does not hold", None: "open"}[self.holds]

    def __str__(self) -> str:
        return f"{self.verdict.upper()}: {self.says}\n  {self.found}"


def above(says: str, first: FloatArray, second: FloatArray, least: float = 0.0, unit: str = "m/s") -> Claim:
    """Return the claim that the mean of one is above that of the other by `least`; each `(r,)` by repetition."""
    away = _difference(first, second)
    means = f"{np.nanmean(first):.3f} and {np.nanmean(second):.3f} {unit}".rstrip()
    found = (
        f"{means}, n = {len(first)} and {len(second)}; difference {away[0]:.3f} ({away[1]:.3f} to {away[2]:.3f})"
        + (f"; limit {least:.3f}" * bool(least))
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


Reads = Callable[[Path, Spec], list[Arm]]
"""Returns experiments, given the folder of studies and changes of their specs."""


@dataclass(frozen=True)
class System:
    """The check of a system.

    Attributes:
        studies: their specs by label, or functions that read experiments of others.
        judge: returns the claims, given the experiments of each study, in the order of its strategies.
    """

    studies: Mapping[str, Spec | Reads]
    judge: Callable[..., Iterator[Claim]]

    def claims(self, folder: Path, changes: Spec) -> Iterator[Claim]:
        """Yield the claims, judged; studies that are missing in the folder are computed, with these changes."""
        yield from self.judge(**{label: self._read(label, folder, changes) for label in self.studies})

    def _read(self, label: str, folder: Path, changes: Spec) -> list[Arm]:
        found = self.studies[label]
        if callable(found):
            return found(folder, changes)
        return arms(f"system-{label.replace('_', '-')}", found | changes, folder)


@lru_cache(maxsize=4)
def _arms(archive: Path) -> list[Arm]:
    result = gaplab.run(archive)
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


def arms(label: str, spec: Spec, folder: Path) -> list[Arm]:
    """Return the experiments of a study, in the order of its strategies, from its archive or by computing it."""
    return _arms(computed(label, spec, folder))


def computed(name: str, spec: Spec, folder: Path) -> Path:
    """Return the archive of a study, which is computed if it is not there."""
    archive = folder / f"{name}.zip"
    if not archive.exists():
        kept(archive, lambda _: {"name": name, "seed": 2026} | spec)
    return archive


def asked(prog: str, description: str | None, names: Collection[str]) -> Namespace:
    """Return the `names` that a command was given, of these; its `folder` of studies; and whether it is to `smoke`."""
    parser = ArgumentParser(prog=prog, description=description)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(names)}; default: all")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="of the studies; default: docs/studies")
    parser.add_argument("--smoke", action="store_true", help="try the studies at a tiny size; name another folder too")
    given = parser.parse_args()
    if given.smoke and given.folder == FOLDER:
        parser.error("--smoke needs a --folder of its own: its studies have the names of those in docs/studies")
    if unknown := set(given.names) - set(names):
        parser.error(f"nothing is called {', '.join(sorted(unknown))}")
    return given


SYSTEMS: dict[str, System] = {}


def check(**studies: Spec | Reads) -> Callable[[Callable[..., Iterator[Claim]]], Callable[..., Iterator[Claim]]]:
    """Register a function as the check of the system with its name, on these studies."""

    def register(judge: Callable[..., Iterator[Claim]]) -> Callable[..., Iterator[Claim]]:
        SYSTEMS[judge.__name__] = System(studies, judge)
        return judge

    return register
