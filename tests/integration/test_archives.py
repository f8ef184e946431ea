"""Out of one database and into another: the same to the last bit, whatever the databases and the numbers."""

import json
import sqlite3
import tracemalloc
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import UTC, datetime, timedelta
from io import BytesIO
from math import copysign, inf, nan
from pathlib import Path
from threading import Barrier
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic_core import to_json
from sqlalchemy import insert

from gaplab import migrations
from gaplab.schemas.lifecycle import Ending, ExtensionSpec, State, Verb
from gaplab.schemas.spec import StudySpec
from gaplab.services.archives import export, import_archive
from gaplab.services.archives import reading as importing
from gaplab.services.archives.checking import check_logs
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import Conflict, NotFound
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Transferred, Tuned
from gaplab.services.experiments import lifecycle, reading, submission
from gaplab.services.results import curves
from gaplab.services.results.misfit import misfit
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.models import Base, ExperimentRow, RepetitionRow, StepRow
from gaplab.services.store.queries.attempts import attempts_of
from gaplab.services.store.session import Store
from tests.archiving import database_of, dump, exported, imported, packed, rows
from tests.experiments import AWKWARD, cancel, listed, run, some_log, submit_one, toy

EVERY = settings(max_examples=6, suppress_health_check=[HealthCheck.function_scoped_fixture])

FINITE = st.floats(allow_nan=False, allow_infinity=False)
FITNESS = FINITE | st.just(nan)
ERROR = st.floats(0, allow_nan=False, allow_infinity=False) | st.just(inf)
COST = st.builds(Cost, st.integers(0, 2**40), st.just(0), st.integers(0, 2**40))
GENOME = st.lists(FINITE, min_size=1, max_size=9).map(frozen)
MEMBERS = st.lists(st.lists(FINITE, min_size=2, max_size=2), max_size=3).map(
    lambda rows: frozen(np.reshape(rows, (-1, 2)) if rows else np.empty((0, 0)))
)
SIMULATOR = st.builds(Simulator, st.lists(FINITE, min_size=2, max_size=2).map(frozen), ERROR)
TOY_STUDY = {"robot": "toy_function", "budget": "smoke", "iterations": 2, "repetitions": 2}
NAME = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1, max_size=200)


@st.composite
def logs(draw: Any) -> Any:
    """A whole log of a toy experiment with whatever numbers."""
    return list(_steps(draw))


def _steps(draw: Any) -> Iterator[Any]:
    for iteration in range(3):
        if iteration:
            yield Selected(iteration, draw(GENOME), draw(COST), members=draw(MEMBERS))
            yield Measured(iteration, Sample(draw(GENOME), draw(FITNESS)))
        yield Tuned(iteration, tuple(draw(st.lists(SIMULATOR, min_size=1, max_size=4))), draw(COST))
        yield Transferred(iteration, draw(GENOME), draw(FITNESS), draw(COST), draw(MEMBERS))
        yield Probed(iteration, draw(FITNESS), draw(FITNESS))


def finished(store: Store, log: Any = None, **changes: Any) -> Any:
    """The id of an experiment whose repetitions are all complete."""
    submitted = submit_one(store, toy(**changes)).id
    while claims := execution.claim(store, "me", 9):
        for claim in claims:
            run(store, claim, iter(log) if log else some_log())
    return submitted


def shown(store: Store, experiment: Any) -> Any:
    """Everything that the service shows of it, but for its sensitivity check, which is its tunables'."""
    return (
        reading.read_experiment(store, experiment).model_dump(exclude={"sensitivity"}),
        reading.list_repetitions(store, experiment),
        reading.list_samples(store, experiment),
        reading.list_simulators(store, experiment),
        curves.curve(store, experiment),
        misfit(store, experiment),
    )


def forget(store: Store) -> None:
    """Remove what there is, as an import must find its ids free again."""
    with store.transaction() as session:
        for table in reversed(Base.metadata.sorted_tables):
            if table.name != "event_counter":
                session.execute(table.delete())


@pytest.mark.dialects
def test_an_experiment_goes_to_the_other_kind_of_database_and_back(store: Store, other: Any) -> None:
    submitted = finished(store, reality={"parameters": {"static_friction": 0.9}})
    before, archive = shown(store, submitted), exported(export(store, submitted))

    there = import_archive(other, BytesIO(archive))
    assert shown(other, submitted) == before
    back = exported(export(other, submitted))
    forget(store)
    imported(store, back)

    assert (there.experiments, there.renamed, there.called_off) == ((submitted,), {}, ())
    assert back == archive == exported(export(store, submitted))
    assert shown(store, submitted) == before


@pytest.mark.dialects
@EVERY
@given(st.data())
def test_whatever_numbers_and_names_go_there_and_back(store: Store, other: Any, data: Any) -> None:
    forget(store)
    forget(other)
    submitted = finished(store, data.draw(logs()), repetitions=1, name=data.draw(NAME))
    archive = exported(export(store, submitted))

    imported(other, archive)

    assert exported(export(other, submitted)) == archive
    assert to_json(shown(other, submitted)) == to_json(shown(store, submitted))


@pytest.mark.dialects
def test_a_zero_has_no_sign_in_either_database(store: Store, other: Any) -> None:
    submitted = finished(store, list(some_log(recorded=-0.0)), repetitions=1)
    archive = exported(export(store, submitted))

    imported(other, archive)

    assert exported(export(other, submitted)) == archive
    values = [value for point in curves.curve(store, submitted).points for value in point.values if value is not None]
    assert copysign(1, values[0]) == 1


@pytest.mark.dialects
def test_an_archive_may_arrive_twice_at_once(store: Store, other: Any) -> None:
    archive, ready = exported(export(store, finished(store))), Barrier(2)

    def write(*work: Any) -> Any:
        """Begin when the other one does."""
        ready.wait(timeout=60)
        return other.write(*work)

    place: Any = SimpleNamespace(reading=other.reading, write=write)
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(lambda _: imported(place, archive), range(2)))

    assert sorted(len(each.renamed) for each in both) == [0, 1]


def test_the_best_of_repetitions_whose_sum_is_no_number_is_one(store: Store) -> None:
    greatest = 1.7e308
    id_ = finished(store, list(some_log(recorded=greatest)))

    assert reading.read_experiment(store, id_).best_fitness == pytest.approx(greatest)


def test_a_study_goes_there_with_all_that_is_its_own(store: Store, other: Any) -> None:
    study = submission.submit(
        store,
        StudySpec.model_validate(TOY_STUDY | {"strategies": ["random", "direct"]}),
    )
    direct = study.experiments[1].id
    while claims := execution.claim(store, "me", 99):
        for claim in claims:
            iterations = 0 if claim.experiment_id == direct else claim.spec.iterations
            three = len(claim.spec.tunables)
            log = [_fitting(step, three) for step in some_log(iterations)]
            run(store, claim, iter(log))
    finished(store)

    archive = exported(export(store, study.id))
    stored = imported(other, archive)

    assert stored.study == study.id
    assert stored.experiments == tuple(each.id for each in study.experiments)
    assert len(listed(other)) == 2
    assert curves.curves(other, [study.id]) == curves.curves(store, [study.id])
    assert exported(export(other, study.id)) == archive


def _fitting(step: Any, tunables: Any) -> Any:
    """The same step for so many tunables."""
    if not isinstance(step, Tuned):
        return step
    simulators = tuple(Simulator(frozen([0.5] * tunables), each.squared_error) for each in step.simulators)
    return Tuned(step.iteration, simulators, step.cost)


def test_an_experiment_of_a_study_goes_on_its_own(store: Store, other: Any) -> None:
    study = submission.submit(store, StudySpec.model_validate(TOY_STUDY | {"strategies": ["random", "direct"]}))
    experiment, left = (each.id for each in study.experiments)

    imported(other, exported(export(store, experiment)))

    arrived = reading.read(other, study.id)
    assert (arrived.name, [each.id for each in arrived.experiments]) == (study.name, [experiment])
    with pytest.raises(NotFound):
        reading.read(other, left)


def test_ids_that_are_taken_become_new_ones_and_the_rest_is_the_same(store: Store) -> None:
    submitted = finished(store)
    archive = exported(export(store, submitted))

    stored = imported(store, archive)

    (new,) = stored.experiments
    assert stored.renamed == {submitted: new}
    assert new != submitted
    for first, second in zip(shown(store, submitted), shown(store, new), strict=True):
        assert to_json(first) == to_json(second).replace(new.encode(), submitted.encode())


def test_what_was_not_computed_yet_arrives_called_off_and_nothing_of_it_runs(store: Store, other: Any) -> None:
    submitted = submit_one(store, toy()).id
    first, second = execution.claim(store, "me", 2)
    run(store, first)
    for step in list(some_log())[:4]:
        assert execution.record(store, second, step)

    stored = imported(other, exported(export(store, submitted)))

    assert stored.called_off == (submitted,)
    assert reading.read_experiment(other, submitted).state is State.CANCELLED
    states = [each.state for each in reading.list_repetitions(other, submitted)]
    assert states == [State.COMPLETED, State.CANCELLED, State.CANCELLED]
    assert execution.claim(other, "me", 9) == ()
    assert execution.requeue_lost(other, stale_after_s=-1) == 0
    assert curves.curve(other, submitted).points == curves.curve(store, submitted).points
    assert reading.list_samples(other, submitted) == reading.list_samples(store, submitted)
    assert reading.read_experiment(store, submitted).state is State.RUNNING


@pytest.mark.parametrize("ended", [False, True])
def test_reality_is_hidden_until_its_study_has_ended(store: Store, other: Any, ended: Any) -> None:
    spec = TOY_STUDY | {"strategies": ["direct", "random"], "repetitions": 1}
    truth = {"reality": {"parameters": {"static_friction": 0.98765}}, "tunables": ["static_friction", "restitution"]}
    study = submission.submit(store, StudySpec.model_validate(spec | truth))
    (claim,) = execution.claim(store, "me", 1)
    run(store, claim, some_log(0))
    if ended:
        cancel(store, study.experiments[1].id)

    archives = [exported(export(store, study.id)), exported(export(store, study.experiments[0].id))]

    for archive in archives:
        assert ("0.98765" in dump(archive)) is ended
        stored = imported(other, archive)
        first = stored.experiments[0]
        found = reading.read_experiment(other, first).spec["reality"]["parameters"]["static_friction"]
        assert found == (0.98765 if ended else None)
        assert curves.curve(other, first).points == curves.curve(store, study.experiments[0].id).points
        assert misfit(other, first).points == ()


@pytest.mark.dialects
def test_an_export_is_of_one_moment_while_a_supervisor_writes(store: Store, other: Any) -> None:
    submitted = submit_one(store, toy(repetitions=6)).id
    for claim in execution.claim(store, "me", 6):
        run(store, claim)
        archive = export(store, submitted)
        if claim.number == 3:
            stored = imported(other, archive.file.read())  # which refuses rows that are no whole logs
            assert reading.read_experiment(other, stored.experiments[0]).progress.completed == claim.number + 1
        archive.file.close()


def test_whoever_opens_an_archive_finds_tables_and_specs(sqlite_store: Store) -> None:
    submitted = finished(sqlite_store)
    archive = exported(export(sqlite_store, submitted))

    (row,) = rows(archive, "SELECT * FROM experiment")
    measured = rows(archive, "SELECT * FROM step WHERE kind IN ('measured', 'probed')")

    assert len(measured) == len(reading.list_samples(sqlite_store, submitted).items)
    genome = next(json.loads(each["body"])["genome"] for each in measured if each["kind"] == "measured")
    assert np.array_equal(genome, AWKWARD)
    assert copysign(1, genome[6]) == -1  # that zero is negative
    assert json.loads(row["spec"])["strategy"]["name"] == "simulated_fit"
    assert {each["owner"] for each in rows(archive, "SELECT owner FROM repetition")} == {None}


def test_the_database_of_an_archive_is_the_same_in_any_process(sqlite_store: Store) -> None:
    """SQLAlchemy has the indices of a table in a set, and so in any order."""
    archive = exported(export(sqlite_store, finished(sqlite_store)))

    made = rows(archive, "SELECT tbl_name, name FROM sqlite_master WHERE type = 'index' AND sql IS NOT NULL")

    for table in {each["tbl_name"] for each in made}:
        names = [each["name"] for each in made if each["tbl_name"] == table]
        assert names == sorted(names)


def test_a_service_opens_the_database_of_an_archive(sqlite_store: Store, tmp_path: Path) -> None:
    submitted = finished(sqlite_store)
    archive = exported(export(sqlite_store, submitted))
    (tmp_path / "study.sqlite3").write_bytes(database_of(archive))

    migrations.upgrade(f"sqlite:///{tmp_path / 'study.sqlite3'}")
    with Store(f"sqlite:///{tmp_path / 'study.sqlite3'}") as opened:
        opened.check()
        assert shown(opened, submitted) == shown(sqlite_store, submitted)
        assert exported(export(opened, submitted)) == archive
        assert submission.submit(opened, toy()).id != submitted


def test_an_archive_of_an_earlier_version_is_migrated(store: Store, other: Store, tmp_path: Path) -> None:
    """At revision 0004 this experiment had no study."""
    submitted = finished(store)
    (tmp_path / "now.db").write_bytes(database_of(exported(export(store, submitted))))
    migrations.upgrade(f"sqlite:///{tmp_path / 'earlier.db'}", to="0004")
    with closing(sqlite3.connect(tmp_path / "earlier.db")) as earlier:
        earlier.execute("ATTACH ? AS now", (str(tmp_path / "now.db"),))
        for table in ("provenance", "experiment", "experiment_provenance", "repetition", "step", "attempt"):
            known = [
                {name for _, name, *_ in earlier.execute(f"PRAGMA {of}.table_info({table})")} for of in ("main", "now")
            ]
            columns = ", ".join(f"[{name}]" for name in known[0] & known[1])
            earlier.execute(f"INSERT INTO main.{table} ({columns}) SELECT {columns} FROM now.{table}")
        earlier.execute("UPDATE main.experiment SET study_id = NULL")
        earlier.commit()

    stored = imported(other, packed((tmp_path / "earlier.db").read_bytes()))

    assert (stored.study, stored.experiments) == (submitted, (submitted,))
    assert shown(other, submitted) == shown(store, submitted)


def test_attempts_go_with_it_and_none_goes_on(store: Store, other: Any) -> None:
    submitted = submit_one(store, toy(repetitions=2)).id
    first, second = execution.claim(store, "me", 2)
    run(store, first)
    assert execution.release(store, second, "its worker was lost")
    execution.claim(store, "another", 1)

    imported(other, exported(export(store, submitted)))

    there, here = (attempts(each, submitted, 0) for each in (store, other))
    assert here == there
    *before, last = attempts(other, submitted, 1)
    assert before == list(attempts(store, submitted, 1)[:-1])
    assert (last.owner, last.ending) == ("another", Ending.CANCELLED)
    assert last.ended_at is not None


def attempts(store: Store, experiment: Any, number: Any) -> Any:
    with store.reading() as session:
        return attempts_of(session, experiment, number)


def test_what_came_without_its_reality_cannot_be_extended(store: Store, other: Any) -> None:
    study = submission.submit(store, StudySpec.model_validate(TOY_STUDY | {"strategies": ["direct", "random"]}))
    direct = study.experiments[0].id
    for claim in execution.claim(store, "me", 9):
        if claim.experiment_id == direct:
            run(store, claim, (_fitting(step, len(claim.spec.tunables)) for step in some_log(0)))

    imported(other, exported(export(store, study.id)))

    assert reading.read_experiment(other, direct).state is State.COMPLETED
    with pytest.raises(Conflict, match="while its reality was hidden"):
        lifecycle.extend(other, direct, ExtensionSpec(repetitions=3))


def test_a_stopped_study_goes_on_from_its_archive_as_if_it_had_never_stopped(store: Store, other: Any) -> None:
    spec = StudySpec.model_validate(TOY_STUDY | {"strategies": ["simulated_fit", "random"]})
    whole = submission.submit(other, spec)
    compute(other)
    expected = [curves.curve(other, each.id).points for each in whole.experiments]
    study = submission.submit(store, spec)
    for claim in execution.claim(store, "me", 2):
        for step, _ in zip(repetition(setting(claim.spec, claim.number)), range(7), strict=False):
            assert execution.record(store, claim, step)
        execution.release(store, claim, "its worker was lost")
    lifecycle.ask(store, study.id, Verb.STOP)

    imported(other, exported(export(store, study.id)))
    stopped = reading.read(other, study.id)
    lifecycle.extend(other, study.id, ExtensionSpec(repetitions=2))
    compute(other)

    assert (stopped.state, stopped.experiments[0].progress.iterations_done) == (State.COMPLETED, 1)
    assert [curves.curve(other, each.id).points for each in study.experiments] == expected


def compute(store: Store) -> None:
    """Compute all that is queued, from its stored steps on."""
    while claims := execution.claim(store, "me", 9):
        for claim in claims:
            run(store, claim, repetition(setting(claim.spec, claim.number), claim.log))


@pytest.mark.dialects
def test_times_keep_their_microseconds(store: Store, other: Any) -> None:
    submitted = finished(store)
    moment = datetime(2012, 11, 5, 9, 0, 0, 123457, tzinfo=UTC)
    with store.transaction() as session:
        session.get(ExperimentRow, submitted).created_at = moment
        session.get(ExperimentRow, submitted).ended_at = moment + timedelta(days=4000)

    imported(other, exported(export(store, submitted)))

    assert reading.read_experiment(other, submitted).created_at == moment


def test_others_write_while_an_archive_is_checked(store: Store, other: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    submitted = finished(store)
    archive = exported(export(store, submitted))

    def check_slowly(*given: Any) -> None:
        submit_one(other, toy(name="meanwhile"))
        check_logs(*given)

    monkeypatch.setattr(importing, "check_logs", check_slowly)
    stored = imported(other, archive)  # or SQLite refuses the writer, after its patience

    assert stored.experiments == (submitted,)
    assert {each.name for each in listed(other)} == {"meanwhile", "simulated_fit"}


@pytest.mark.release
def test_memory_does_not_grow_with_what_is_exported(sqlite_store: Store) -> None:
    """Rows are never all there at once."""
    submitted = finished(sqlite_store, repetitions=1)
    with sqlite_store.transaction() as session:
        (repetition,) = session.query(RepetitionRow).all()
        body = {"simulators": [{"parameters": [0.5] * 20, "squared_error": 1.0}]}
        many = [
            {"repetition_id": repetition.id, "kind": "tuned", "iteration": at, "place": 5 * at, "body": body}
            for at in range(10, 12_010)
        ]
        session.execute(insert(StepRow), many)
    export(sqlite_store, submitted).file.close()
    del many

    tracemalloc.start()
    export(sqlite_store, submitted).file.close()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()

    everything = 12_000 * 20 * 32  # bytes that its floats and lists would take
    assert peak < everything / 2
