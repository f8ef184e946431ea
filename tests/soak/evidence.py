"""What the database has when all is over, and what an undisturbed computation gives."""

import json
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from sqlalchemy import select

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Measured, Probed, Step, place_of
from gaplab.services.specs.assembly import setting
from gaplab.services.store.models import AnswerRow, ExperimentRow, RepetitionRow, RequestRow, SensitivityRow, StudyRow
from gaplab.services.store.queries.logs import columns_of, logs
from gaplab.services.store.session import Store
from tests.soak import witness
from tests.soak.hardware_faults import Command, commands
from tests.soak.operators import as_simulated


@dataclass(frozen=True)
class Repetition:
    """A repetition as it ended; `log` has a digest for each of its steps, in their order."""

    id: int
    number: int
    state: str
    epoch: int
    steps: int
    iterations_done: int
    log: tuple[str, ...]
    places: tuple[int, ...]
    error: str | None = None


@dataclass(frozen=True)
class Experiment:
    """An experiment as it ended."""

    id: str
    study: str | None
    name: str
    state: str
    spec: dict
    repetitions: tuple[Repetition, ...]


@dataclass(frozen=True)
class Answer:
    """An answer of an operator as it is stored."""

    request: str
    state: str
    operator: str = ""
    bench: str = ""
    values: tuple[float, ...] = ()


@dataclass(frozen=True)
class Evidence:
    """All that is in the database.

    Attributes:
        experiments, checks: as they ended; checks are states by id.
        studies: names by id.
        moves: of all repetitions, as the witness saw them.
        complaints: of the database about itself.
        answers: of operators, by id.
        commands: that robots got, in their order.
    """

    experiments: tuple[Experiment, ...] = ()
    studies: dict[str, str] = field(default_factory=dict)
    checks: dict[str, str] = field(default_factory=dict)
    moves: tuple[witness.Move, ...] = ()
    complaints: tuple[str, ...] = ()
    commands: tuple[Command, ...] = ()
    answers: dict[str, Answer] = field(default_factory=dict)


def gather(store: Store, database: Any, journal: Path) -> Evidence:
    """Read everything."""
    with store.reading() as session:
        studies = dict(session.execute(select(StudyRow.id, StudyRow.name)).all())
        checks = dict(session.execute(select(SensitivityRow.id, SensitivityRow.state)).all())
        experiments = tuple(_experiment(session, row) for row in session.scalars(select(ExperimentRow)).all())
        answered = session.execute(select(AnswerRow, RequestRow.bench).join(RequestRow)).all()
        answers = {
            row.id: Answer(row.request_id, str(row.state), row.operator, bench, tuple(row.values or ()))
            for row, bench in answered
        }
    return Evidence(
        experiments,
        studies,  # type: ignore[arg-type]
        checks,  # type: ignore[arg-type]
        tuple(witness.moves(store)),
        tuple(database.complaints()),
        tuple(commands(journal)),
        answers,
    )


def checks_under_way(store: Store) -> bool:
    """Whether sensitivity checks have not ended; the API lists none."""
    with store.reading() as session:
        return any(not state.ended for state in session.scalars(select(SensitivityRow.state)))


def _experiment(session: Any, row: Any) -> Any:
    rows = session.scalars(
        select(RepetitionRow).where(RepetitionRow.experiment_id == row.id).order_by(RepetitionRow.number)
    ).all()
    steps = logs(session, [each.id for each in rows])
    found = tuple(
        Repetition(
            id=each.id,
            number=each.number,
            state=str(each.state),
            epoch=each.epoch,
            steps=each.steps,
            iterations_done=each.iterations_done,
            log=tuple(digest(step, measured=on_a_bench(row.spec)) for step in steps[each.id]),
            places=tuple(map(place_of, steps[each.id])),
            error=each.error,
        )
        for each in rows
    )
    return Experiment(row.id, row.study_id, row.name, str(row.state), row.spec, found)


def undisturbed(spec: dict, number: int) -> tuple[str, ...]:
    """The digests of one repetition's steps, computed here and now with nothing in the way.

    A robot on a bench of the soak has no noise, so a simulated reality gives its steps.
    """
    measured = on_a_bench(spec)
    if measured:
        reality = as_simulated(spec["robot"]["name"]).model_dump(mode="json")
        spec = spec | {"reality": reality | {"probes": spec["reality"]["probes"]}}
    settings = {name: value for name, value in spec.items() if name not in {"name", "repetitions"}}
    return _undisturbed(json.dumps(settings, sort_keys=True), number, measured)


def on_a_bench(spec: dict) -> bool:
    """Whether operators measure its controllers."""
    return bool(spec["reality"].get("kind") == "physical")


@cache
def _undisturbed(spec: str, number: int, measured: bool) -> tuple[str, ...]:
    steps = repetition(setting(ExperimentSpec.model_validate_json(spec), number))  # type: ignore[arg-type]
    return tuple(digest(step, measured=measured) for step in steps)


def digest(step: Step, *, measured: bool) -> str:
    """A hash of all that the store keeps of a step; floats to the last bit. Those who measure give no readings."""
    kept = columns_of(step)
    if measured and isinstance(step, Measured | Probed):
        kept["body"].pop("readings", None)
    return sha256(json.dumps(kept, sort_keys=True).encode()).hexdigest()
