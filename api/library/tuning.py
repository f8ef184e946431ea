"""`gaplab.Tuning`: it asks for controllers to try in reality, is told what they do there, and tunes a simulator.

It is one study of one repetition with a physical reality, in a database of its own.
"""

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from time import monotonic
from typing import TYPE_CHECKING, Any, Self, TypeAlias, TypeVar
from weakref import finalize

from gaplab.api.library.computing import compute
from gaplab.api.library.robots import AnyRobot, settings, with_files
from gaplab.api.library.running import SQLITE, Result, begins, database, study_of
from gaplab.api.library.told import measured, sample_of, samples_in
from gaplab.api.library.tuned import Genome, TunedSimulator
from gaplab.schemas.corrections import VoidSpec
from gaplab.schemas.lifecycle import ExtensionSpec, State
from gaplab.schemas.measurements import RequestRead
from gaplab.schemas.records import SimulatorRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import Conflict
from gaplab.services.core.strategies import strategies
from gaplab.services.core.types import Measured, Step, Transferred, Tuned, learnable
from gaplab.services.experiments import lifecycle, reading
from gaplab.services.experiments.stored_files import resolved_here
from gaplab.services.experiments.submission import submit
from gaplab.services.findings.wording import many, number
from gaplab.services.measuring import taking, telling
from gaplab.services.plugins import folders
from gaplab.services.results.misfit import misfit
from gaplab.services.specs.assembly import edits_of
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.robots import robot_of
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries.experiments import get_experiment, repetitions_of
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import url_of
from gaplab.services.world.robot_library import label_of, robot_file

if TYPE_CHECKING:
    import pandas

    from gaplab.api.library.writing import Written

S = TypeVar("S", Tuned, Transferred)

Told: TypeAlias = "Iterable[float] | str | Path | pandas.DataFrame | Sequence[Mapping[str, Any]]"
"""A controller, or a table of samples."""


class Tuning(Result):
    """A simulator that is tuned on what a robot does in reality; a person or a loop of a driver runs the robot.

        tuning = gaplab.Tuning("a1.urdf", ["mass(trunk)", "max_torque", "friction"])
        genome = tuning.ask()              # the next controller to try; genome.motion has its commands
        tuning.tell(genome, fitness=0.41)
        tuning.simulator                   # values, 95 % intervals, and which tunables are identified
        tuning.save_robot("a1_tuned.urdf")

    Nothing is computed until it is asked for. What is complete is kept, whatever interrupts it. What `gaplab.run`
    returns has the other methods: `save` writes a file for `Tuning.load`, or for the bench of a service.

    Args:
        robot: its name; its robot file, URDF or MJCF, which is imported as by `gaplab robot import`; or a spec of its
            `robot`, `controller`, `task` and `engine`; all else is an argument.
        tunables: labels, or objects with bounds as in a spec; left out: the robot's usual ones.
        pool: a file of recordings, as `gaplab pool import` writes; the simulator is tuned on all that are not held out
            (`reality={"held_out": 0.2}`), and nothing is asked for or told.
        strategy: which controllers are asked for.
        tuner: how simulators are found; the default gives intervals.
        budget: evaluations of each search; the default is a tenth of the paper's rollouts.
        path: an SQLite database that keeps everything, created if absent; if it is there, the tuning in it goes on.
            Left out: a temporary one, which ends with this object.
        progress: show long computations on standard error or in the notebook; left out: in a terminal or a notebook.
        fields: other fields of the spec of an experiment, like `engine`, `task`, `seed`, `held_out`, `discrepancy`.

    Raises:
        InvalidSpec: the spec is refused; with every violation.
        Conflict: the database at `path` has another tuning, or this would not be one.
    """

    def __init__(
        self,
        robot: AnyRobot,
        tunables: Sequence[Any] | None = None,
        *,
        pool: str | Path | None = None,
        path: str | Path | None = None,
        progress: bool | None = None,
        **fields: Any,  # noqa: ANN401 - as in a spec
    ) -> None:
        usual = {
            "strategy": "simulated_fit_and_informative" if pool is None else "direct",
            "tuner": "gauss_newton",
            "budget": "lean",
            "repetitions": 1,
        }
        given = {"kind": "physical", "probes": "never"} if pool is None else {"kind": "recorded", "pool": str(pool)}
        reality = {"probes": "never", **fields.pop("reality", {}), **given}
        spec = settings(ExperimentSpec, robot, tunables=tunables, reality=reality, **usual | fields)
        self._open_at(path, Path(robot).parent if isinstance(robot, str | Path) else Path(), progress)
        spec = with_files(self._store, spec)
        resolved = resolved_here(self._store, spec, resolve_experiment)
        _check(resolved)
        try:
            self.id = study_of(self._store, self.path, self.path)
        except FileNotFoundError:
            self.id = submit(self._store, spec).id
        given, here = resolved.model_dump(exclude={"iterations", "name"}), self.spec.model_dump()
        if differing := [name for name, value in given.items() if value != here[name]]:
            raise Conflict(f"{path} has a tuning with another {', '.join(differing)}: load it, or use a new path")

    @classmethod
    def load(cls, file: str | Path, *, path: str | Path | None = None, progress: bool | None = None) -> Self:
        """Return the tuning of a file of `save`, of a service's archive, or of a database at a `path`.

        Args:
            file: the archive of a study of one repetition on a bench, or the database.
            path: a new database for an archive; left out: a temporary one.
            progress: as of `Tuning`.

        Raises:
            InvalidArchive: the file is damaged, or not an archive.
            Conflict: it is not of one repetition with a physical reality.
        """
        folders.load()
        found, file = cls.__new__(cls), Path(file).absolute()
        if path is not None and Path(path).exists():
            raise FileExistsError(f"{path} exists, and the tuning in it goes on by itself: Tuning.load({str(path)!r})")
        found._open_at(file if begins(file, SQLITE) else path, file.parent, progress)
        found.id = study_of(found._store, found.path, file)
        _check(found.spec)
        return found

    def _open_at(self, path: str | Path | None, folder: Path, progress: bool | None) -> None:
        self._folder, self._progress = folder, progress
        file = database(path)
        super().__init__(Store(url_of(file)), file, "")
        if path is None:
            finalize(self, rmtree, file.parent, ignore_errors=True)

    def ask(self, *, timeout_s: float = math.inf) -> Genome:
        """Return the controller to try next in reality; the same one until it, or another one, is told.

        Raises:
            TimeoutError: it takes longer; what is computed is kept, and the next call goes on.
        """
        self._refuse_a_pool()
        until = monotonic() + timeout_s
        while not (asked := self._asked()):
            if reading.read(self._store, self.id).state is State.COMPLETED:
                lifecycle.extend(self._store, self.id, ExtensionSpec(iterations=self.spec.iterations + 1))
            compute(self._store, self.id, None, until, progress=self._progress)
        return Genome.of(asked[0].genome, self.spec, None, asked[0].expected)

    def tell(
        self,
        genome: Told,
        fitness: float | Sequence[float | None] | None = None,
        *,
        readings: Any = None,  # noqa: ANN401 - numbers in whatever holds them
        trace: str | Path | Sequence[str | Path] = (),
        confirmed: bool = False,
        **parts: Any,  # noqa: ANN401 - those of an answer
    ) -> None:
        """Add a measurement: of the controller that was asked for, or of any other. Nothing is computed.

        A controller that was told before gets the new measurement in place of the old one. What was computed from that
        is computed again; all other measurements stay.

        Args:
            genome: `(g,)`; or many samples: a CSV file, a data frame or a list, as `gaplab.read_samples` describes.
            fitness: in the robot's unit: one value, or one for each repeat; None or nan for a repeat that failed.
            readings: what the sensors said, `(times, sensors)`, in their units, nan where one failed; of several
                repeats, `(r, times, sensors)`.
            trace: in place of both: a recording of the robot, or one for each repeat, as of `Bench.attach_trace`.
            confirmed: take unlikely traces and values without a doubt.
            parts: `failed`: why there is no fitness; `lags_s`: when the motion began on the clock of each trace;
                `columns`: what each joint is called in the traces, and how it counts; `unit`, `operator`, `note`.

        Raises:
            InvalidSpec: the controller or its measurement does not fit the robot; with every violation.
            InvalidSamples: the table has errors; with all of them.
            Conflict: a trace is unlikely, and not `confirmed`.
        """
        self._refuse_a_pool()
        spec, traces = self.spec, [trace] if isinstance(trace, str | Path) else trace
        told = samples_in(genome, spec, confirmed=confirmed)
        if told is None:
            parts |= measured(fitness, readings) | {"confirmed": confirmed}
            told = [sample_of(self._store, spec, self._expecting(), frozen(genome), traces, **parts)]
        for answer in telling.tell(self._store, self.id, told):
            for doubt in answer.doubts:
                warnings.warn(f"{doubt}; if it is right, tell it with confirmed=True", stacklevel=2)

    def forget(self, genome: Iterable[float], reason: str = "it was told by mistake") -> None:
        """Take the measurement of a controller back; NotFound without one. What followed is computed again."""
        telling.forget(self._store, self.id, frozen(genome), VoidSpec(reason=reason))

    @property
    def simulator(self) -> TunedSimulator:
        """The best simulator, as of `tune`."""
        return self.tune()

    def tune(self, *, timeout_s: float = math.inf) -> TunedSimulator:
        """Return the best simulator; it is tuned if something was told since.

        Raises:
            Conflict: nothing was told yet, or its strategy tunes nothing.
            TimeoutError: it takes longer; what is computed is kept, and the next call goes on.
        """
        self._refuse_untuned()
        self._latest(Tuned, timeout_s)
        return TunedSimulator.of(self._best(), misfit(self._store, self.id))

    @property
    def controller(self) -> Genome:
        """The fittest controller that was found in the tuned simulator, as of `transfer`."""
        return self.transfer()

    def transfer(self, *, timeout_s: float = math.inf) -> Genome:
        """Return the fittest controller that a search finds in the tuned simulator. Errors are those of `tune`."""
        step = self._latest(Transferred, timeout_s)
        return Genome.of(step.genome, self.spec, None if math.isnan(step.fitness) else step.fitness)

    def save_robot(self, file: str | Path, original: str | Path | None = None, *, partial: bool = False) -> "Written":
        """Write the tuned simulator into a copy of the robot's URDF or MJCF, or as a robot file, and compare rollouts.

        Args:
            file: what to write: `.urdf`, `.xml` or `.json`.
            original: what the robot was imported from; left out: it is looked for beside the robot's file.
            partial: leave out values that the format has no place for; they become comments.

        Raises:
            InvalidRobot: it was not written; with every reason.
        """
        from gaplab.api.library.writing import write_robot  # with SciPy and lxml, which tuning does not need

        self._refuse_untuned()
        self._latest(Tuned, math.inf)
        source = Path(original) if original is not None else self._original(Path(file).suffix)
        return write_robot(self.id, self.spec, self._best(), Path(file), source, partial=partial)

    def __repr__(self) -> str:
        spec, samples = self.spec, [step.sample for step in self._log() if isinstance(step, Measured)]
        best = max((each.fitness for each in learnable(samples)), default=None)
        told = many(len(samples), "measurement") + ("" if best is None else f", fittest {number(best)}")
        told += "; one controller is asked for" if self._asked() else ""
        return f"<tuning of {label_of(spec.robot)} by {spec.strategy.name}: {told}>"

    def _repr_html_(self) -> str:
        tuned = next((step for step in reversed(self._log()) if isinstance(step, Tuned | Measured)), None)
        return f"<p>{repr(self)[1:-1]}</p>{self.simulator._repr_html_() if isinstance(tuned, Tuned) else ''}"

    @property
    def spec(self) -> ResolvedSpec:
        """The complete spec."""
        with self._store.reading() as session:
            return spec_of(get_experiment(session, self.id).spec)

    def _log(self) -> tuple[Step, ...]:
        with self._store.reading() as session:
            (row,) = repetitions_of(session, self.id)
            return logs(session, [row.id])[row.id]

    def _refuse_a_pool(self) -> None:
        if self.spec.reality.kind == "recorded":
            raise Conflict("the recordings of a pool are all that is known, so nothing is asked for or told")

    def _asked(self) -> Sequence[RequestRead]:
        """Return the request for the measurement that is waited for; empty without one."""
        return taking.list_requests(self._store, taking.RequestFilter(experiment=self.id)).items

    def _latest(self, kind: type[S], timeout_s: float) -> S:
        """Return the latest step of a kind, which is computed if something was told since."""
        until = monotonic() + timeout_s
        while True:
            found = next((step for step in reversed(self._log()) if isinstance(step, kind | Measured)), None)
            if isinstance(found, kind):
                return found
            if found is None and not self.spec.reality.samples and self.spec.reality.kind == "physical":
                raise Conflict("nothing was told yet, so there is nothing to tune on")
            compute(self._store, self.id, kind, until, progress=self._progress)

    def _refuse_untuned(self) -> None:
        name = self.spec.strategy.name
        if name in strategies and not strategies[name].tunes:
            raise Conflict(f"{name} tunes no simulators; `controller` is what it transfers")

    def _best(self) -> SimulatorRead:
        last = max(step.iteration for step in self._log() if isinstance(step, Tuned))
        return reading.list_simulators(self._store, self.id, iteration=last, limit=1).items[0]

    def _expecting(self) -> list[float]:
        """Return the values of the latest simulator; before the first, those of the robot as it is."""
        with suppress(ValueError):
            return list(self._best().parameters.values())
        world = robot_of(self.spec).world
        return [edit.read(world) for edit in edits_of(ref.name for ref in self.spec.tunables)]

    def _original(self, suffix: str) -> Path | None:
        """Return the file that the robot was imported from, if it is beside the robot's file or here."""
        file = robot_file(self.spec.robot.options.get("sha256", ""))
        if file is None or file.source is None or not file.source.file.lower().endswith(suffix.lower()):
            return None
        for folder in (self._folder, Path()):
            with suppress(OSError):
                if sha256((folder / file.source.file).read_bytes()).hexdigest() == file.source.sha256:
                    return folder / file.source.file
        return None


def _check(spec: ResolvedSpec) -> None:
    """Raise Conflict if a spec is not that of a tuning."""
    physical, name = spec.reality.kind == "physical", spec.strategy.name
    selects = name not in strategies or strategies[name].takes_samples
    permitted = "one that selects samples" if physical else "`direct`: it is tuned on the whole pool"
    for place, value, fits, wanted in (
        ("/repetitions", spec.repetitions, spec.repetitions == 1, "1"),
        ("/reality/kind", spec.reality.kind, spec.reality.kind != "simulated", "physical, or recorded"),
        ("/strategy", name, selects == physical, permitted),
    ):
        if not fits:
            raise Conflict(f"{place}: {value} is not of a tuning; permitted: {wanted}")
