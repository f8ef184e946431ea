"""A robot on a bench over HTTP: what an operator, a driver and their mistakes get."""

import json
from collections.abc import Iterator
from pathlib import Path
from threading import enumerate as threads
from typing import Any

import numpy as np
import pytest
import yaml
from httpx2 import MockTransport, Request, Response

import gaplab
from gaplab import Client, InvalidSamples, ServiceError, ServiceUnreachable
from gaplab.api.clients import driving
from gaplab.api.clients.driving import TakeLost
from gaplab.api.clients.journal import Journal
from gaplab.schemas.access import Role
from gaplab.schemas.measurements import RequestRead, TakeSpec
from gaplab.schemas.spec import ExperimentSpec
from gaplab.services import access
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import taking
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.session import Store
from gaplab.services.world.robots.quadruped import Quadruped
from tests.experiments import toy
from tests.integration.test_bench import compute, fall_silent, truth
from tests.integration.test_bench_safety import ask
from tests.integration.test_client import InProcess
from tests.waiting import wait_until

SPEC = {"strategy": "random", "robot": "toy_function", "budget": "smoke", "repetitions": 1, "iterations": 2}
REALITY = {"kind": "physical", "probes": "each"}


class Supervised(InProcess):
    """The service in this process; if `computing`, a supervisor does what can be done after each change."""

    computing = False

    def __init__(self, store: Store) -> None:
        super().__init__(store)
        self._store = store

    def handle_request(self, request: Request) -> Response:
        try:
            return super().handle_request(request)
        finally:
            if self.computing and request.method != "GET":
                compute(self._store)


@pytest.fixture
def network(store: Store) -> Iterator[Supervised]:
    network = Supervised(store)
    yield network
    network.close()


@pytest.fixture
def client(network: Supervised) -> Client:
    return Client("http://test", transport=network, pauses_s=(0.0, 0.0, 0.0))


@pytest.fixture
def computing(network: Supervised) -> None:
    network.computing = True


def submitted(client: Client, **reality: Any) -> Any:
    return client.submit(SPEC | {"reality": REALITY | reality})


def fitness(task: Any) -> float:
    return truth(toy(strategy="random", reality=REALITY))(task.genome)


@pytest.mark.usefixtures("computing")
def test_a_driver_is_a_loop_of_one_line(client: Client) -> None:
    experiment = submitted(client)
    asked = []
    for request in client.requests(experiment.id):
        asked.append((request.request.iteration, request.request.kind.value))
        with pytest.raises(ServiceError, match="has no actuators"):
            _ = request.motion
        request.tell(fitness(request))
    assert asked == [(0, "probe"), (1, "sample"), (1, "probe"), (2, "sample"), (2, "probe")]
    assert client.experiment(experiment.id).state == "COMPLETED"


@pytest.mark.usefixtures("computing")
def test_a_lost_answer_is_sent_again_and_counts_once(client: Client, network: Supervised, tmp_path: Path) -> None:
    experiment = submitted(client)
    for number, request in enumerate(client.requests(experiment.id, journal=tmp_path / "journal")):
        network.lost = 2 if number == 1 else 0
        request.tell(fitness(request))
    samples = client.samples(experiment.id)
    assert len(samples) == 5
    with Journal(tmp_path / "journal") as journal:
        assert journal.unsent() == []


@pytest.mark.usefixtures("computing")
def test_a_driver_that_died_after_a_repeat_goes_on_with_the_next(client: Client, tmp_path: Path) -> None:
    experiment = submitted(client, repeats=3)
    journal = tmp_path / "journal"
    for request in client.requests(experiment.id, journal=journal):
        request.note(0.25)
        request.note(0.5)
        break  # the power is cut: nothing is told
    with journal.open("ab") as file:
        file.write(b'{"request": "half')
    ran = 0
    for request in client.requests(experiment.id, journal=journal):
        values = [value for value, _ in request.known]
        while len(values) < request.repeats:
            ran += 1
            values.append(0.75)
            request.note(values[-1])
        request.tell(values)
    assert ran == 5 * 3 - 2
    assert client.samples(experiment.id).fitness.iloc[0] == 0.5


@pytest.mark.usefixtures("computing")
def test_repeats_from_before_a_void_do_not_count(client: Client, tmp_path: Path) -> None:
    experiment, known = submitted(client, repeats=3), []
    for value in (0.25, 0.5):
        for request in client.requests(experiment.id, journal=tmp_path / "journal"):
            request.note(value)
            break  # the driver ends
        if value == 0.25:
            answer = client.bench.answer(request.id, [0.1, 0.1, 0.1], operator="Ada")
            client.bench.void(answer, reason="the floor was wet")
    for request in client.requests(experiment.id, journal=tmp_path / "journal"):
        known = request.known
        break

    assert known == [(0.5, None)]


@pytest.mark.usefixtures("computing")
def test_an_answer_in_the_journal_is_sent_when_the_driver_starts_again(client: Client, tmp_path: Path) -> None:
    submitted(client)
    (request,) = client.bench.pending(wait_s=60)
    with Journal(tmp_path / "journal") as journal:
        journal.answer(request.id, {"values": [0.5]})
    assert (tmp_path / "journal").stat().st_mode & 0o777 == 0o600
    for following in client.requests(journal=tmp_path / "journal"):
        assert following.id != request.id
        break
    assert client.bench.request(request.id).state == "measured"


@pytest.mark.usefixtures("computing")
def test_an_answer_in_the_journal_that_is_refused_holds_no_other_back(
    client: Client, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    ended, running = submitted(client, bench="a"), submitted(client, bench="b")
    (wanted_no_more,) = client.bench.pending(ended.id, wait_s=60)
    (wanted,) = client.bench.pending(running.id, wait_s=60)
    client.cancel(ended.id)
    with Journal(tmp_path / "journal") as journal:
        journal.answer(wanted_no_more.id, {"values": [0.25]})
        journal.answer(wanted.id, {"values": [0.5]})

    following = next(client.requests(running.id, journal=tmp_path / "journal"))

    assert following.id != wanted.id
    assert client.bench.request(wanted.id).answers[0].values == (0.5,)
    assert f"the answer {{'values': [0.25]}} in the journal, to request {wanted_no_more.id}, is refused" in caplog.text
    assert "is no longer needed" in caplog.text
    with Journal(tmp_path / "journal") as journal:
        assert journal.unsent() == []


def test_a_driver_finds_an_open_request_behind_a_page_of_those_of_a_busy_bench(
    client: Client, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driving, "PAUSE_S", -1.0)  # a pause of the driver is an error here
    walking = SPEC | {"robot": "quadruped", "engine": "mujoco"}
    many = client.submit(walking | {"repetitions": 52, "reality": REALITY | {"bench": "a"}})
    for _ in range(52):
        ask(store)
    free = submitted(client, bench="b")
    compute(store)
    busy: Any = client.requests(many.id)
    next(busy)

    found = next(client.requests(operator="other"))

    assert found.request.experiment == free.id
    assert len(client.bench.pending()) == 53
    busy.close()


def test_an_answer_that_no_service_knows_stays_in_the_journal(client: Client, store: Store, tmp_path: Path) -> None:
    experiment = submitted(client)
    compute(store)
    with Journal(tmp_path / "journal") as journal:
        journal.answer("of-a-newer-database", {"values": [0.5]})

    loop = client.requests(experiment.id, journal=tmp_path / "journal")
    assert next(loop).request.experiment == experiment.id
    loop.close()  # type: ignore[attr-defined]

    with Journal(tmp_path / "journal") as journal:
        assert [request for request, _, _ in journal.unsent()] == ["of-a-newer-database"]


def test_lines_of_a_journal_that_cannot_be_used_are_kept_beside_it_and_told_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file, beside = tmp_path / "journal", tmp_path / "journal.unreadable"
    with Journal(file) as journal:
        journal.repeat("r", 0.5)
    wrong = [
        b"\xff\x00",
        b'{"request": "r", "answer": {}}',
        b"[1]",
        b"[" * 100_000,
        b'{"request": "r", "repeat": 1e999}',
    ]
    with file.open("ab") as lines:
        lines.write(b"\n".join([*wrong, b'{"sent": ["r"]}', b'{"request": "half']))

    for _ in range(2):
        with Journal(file) as journal:
            journal.repeat("r", 0.25)

    assert journal.repeats("r") == [(0.5, None), (0.25, None), (0.25, None)]
    assert beside.read_bytes().splitlines() == [*wrong, b'{"sent": ["r"]}', b'{"request": "half']
    assert caplog.text.count("a line of the journal cannot be used") == 7


@pytest.mark.parametrize("status", [401, 403])
def test_answers_stay_in_the_journal_while_the_token_is_refused(
    client: Client, network: Supervised, store: Store, tmp_path: Path, status: int
) -> None:
    submitted(client)
    compute(store)
    (request,) = client.bench.pending()
    with Journal(tmp_path / "journal") as journal:
        journal.answer(request.id, {"values": [0.5]})
    network.busy, network.status = 1, status

    with pytest.raises(ServiceError):
        next(client.requests(journal=tmp_path / "journal"))

    with Journal(tmp_path / "journal") as journal:
        assert [answer for _, answer, _ in journal.unsent()] == [{"values": [0.5]}]


def test_a_driver_that_may_read_but_not_take_is_told_so(store: Store, network: Supervised) -> None:
    tokens = {role: access.create_token(store, role, role.value).secret for role in (Role.RUNNER, Role.READER)}
    with Client("http://test", token=tokens[Role.RUNNER], transport=network) as runner:
        submitted(runner)
    compute(store)

    with Client("http://test", token=tokens[Role.READER], transport=network) as reader:
        assert len(reader.bench.pending()) == 1
        with pytest.raises(ServiceError, match="runner") as refused:
            next(reader.requests())

    assert refused.value.problem.status == 403


def test_nonsense_is_refused_with_its_place(client: Client, store: Store) -> None:
    submitted(client)
    compute(store)
    (request,) = client.bench.pending()
    cases: list[tuple[dict[str, Any], str]] = [
        ({"values": [0.5], "unit": "km/h"}, "/unit"),
        ({"values": [0.5, 0.5]}, "/values"),
        ({"values": ["0.5"]}, "/values/0"),
        ({"values": []}, "/values"),
        ({}, ""),
        ({"values": [0.5], "failed": "both"}, ""),
        ({"values": [0.5], "attachments": ["0" * 64]}, "/attachments/0"),
        ({"values": [0.5], "readings": [[[0.1]]]}, "/readings/0"),
        ({"values": [0.5], "surprise": 1}, "/surprise"),
    ]
    for body, pointer in cases:
        with pytest.raises(ServiceError) as refused:
            client._connection.post(object, f"/requests/{request.id}/measurements", body)
        assert refused.value.problem.status == 422
        assert pointer in {each.pointer for each in refused.value.problem.errors or ()}
    for value in ("NaN", "Infinity", "1e999"):
        with pytest.raises(ServiceError) as refused:
            client._connection.change(
                object,
                "POST",
                f"/requests/{request.id}/measurements",
                content=[f'{{"values": [{value}]}}'.encode()],
                headers={"Content-Type": "application/json"},
            )
        assert refused.value.problem.status == 422
    assert client.bench.request(request.id).answers == ()


def test_a_motion_leaves_in_three_formats(client: Client, store: Store) -> None:
    experiment = client.submit(
        SPEC | {"robot": "quadruped", "engine": "mujoco", "reality": {"kind": "physical", "probes": "each"}}
    )
    import numpy as np

    from gaplab.schemas.records import MeasurementKind
    from gaplab.services.core.types import Simulator, Transferred, Tuned
    from gaplab.services.running import execution
    from gaplab.services.store.lease import Requested
    from gaplab.services.world.robots.quadruped import Quadruped

    known = Quadruped().known
    (claim,) = execution.claim(store, "here", 1)
    for step in (Tuned(0, (Simulator(np.array([1.0, 0.8, 0.0])),)), Transferred(0, known, 0.4)):
        execution.record(store, claim, step)
    execution.record_all(store, [(claim, [Requested(2, 0, MeasurementKind.PROBE, known)])])
    (request,) = client.bench.pending(experiment.id)
    lines = client.bench.motion(request.id).splitlines()
    plain = json.loads(client.bench.motion(request.id, "json"))
    points = yaml.safe_load(client.bench.motion(request.id, "ros2"))
    assert plain["actuators"] == points["joint_names"]
    assert lines[0].split(",")[1:] == [f"{name} (rad)" for name in plain["actuators"]]
    assert [float(number) for number in lines[1].split(",")] == [-1.0, *plain["start"].values()]
    assert [float(number) for number in lines[2].split(",")[1:]] == plain["targets"][0]
    times = [each["time_from_start"]["sec"] + each["time_from_start"]["nanosec"] / 1e9 for each in points["points"]]
    assert times == sorted(set(times))
    assert times[-1] - 1.0 == plain["observe_s"][-1] == float(lines[-1].split(",")[0])
    driven = next(client.requests(experiment.id)).motion
    assert (list(driven.actuators), list(driven.units)) == (plain["actuators"], plain["units"])
    assert driven.start == plain["start"]
    assert "Before each repeat, move the joints slowly to the start pose" in plain["between_repeats"]
    assert ([list(row) for row in driven.targets], set(driven.units)) == (plain["targets"], {"rad"})


def test_attachments_are_stored_once_and_never_shown_by_a_browser(client: Client, tmp_path: Path) -> None:
    page = tmp_path / "evil.html"
    page.write_text("<script>alert(1)</script>")
    first, again = client.bench.attach(page, "text/html"), client.bench.attach(page, "text/html")
    assert first == again
    with client._connection.stream("GET", f"/attachments/{first.id}") as answer:
        assert answer.read() == page.read_bytes()
        assert answer.headers["content-type"] == "application/octet-stream"
        assert "attachment" in answer.headers["content-disposition"]


def test_an_attachment_keeps_its_name_in_any_script(client: Client) -> None:
    for name, plain, quoted in (
        ("测试.csv", "__.csv", "%E6%B5%8B%E8%AF%95.csv"),
        ("größe 3.csv", "gr__e_3.csv", "gr%C3%B6%C3%9Fe%203.csv"),
        ('..\\a"\r\nb\u202e', ".._a___b_", ".._a%22__b_"),
    ):
        stored = client.bench._attach(name, name.encode(), "text/csv")
        with client._connection.stream("GET", f"/attachments/{stored.id}") as answer:
            assert answer.read() == name.encode()
            told = answer.headers["content-disposition"]
        assert told == f"attachment; filename=\"{plain}\"; filename*=UTF-8''{quoted}"


def test_a_table_of_samples_is_checked_and_used(client: Client, tmp_path: Path) -> None:
    file = tmp_path / "runs.csv"
    file.write_text("gene_0,value\n0.25,0.41\n1.5,x\n")
    with pytest.raises(InvalidSamples, match=r"runs.csv:3, value: 'x' is not a number") as wrong:
        client.bench.check_samples(file, "toy_function")
    assert [(each.line, each.column) for each in wrong.value.errors] == [(3, "value")]
    file.write_text("gene_0,value\n0.25,0.41\n")
    known = client.bench.check_samples(file, "toy_function", options={})
    experiment = submitted(client, samples=known)
    assert client.experiment(experiment.id).spec["reality"]["samples"][0]["values"] == [0.41]
    with pytest.raises(ServiceError, match="unknown robot"):
        client.bench.check_samples(file, "toy_functoin")
    with pytest.raises(ServiceError, match="options"):
        client.bench.check_samples(file, "toy_function", options={"legs": 4})


@pytest.mark.usefixtures("computing")
def test_errors_of_simulators_count_known_samples(client: Client) -> None:
    known = [{"genome": [gene], "values": [0.4]} for gene in (0.2, 0.7)]
    experiment = submitted(client, samples=known)
    for request in client.requests(experiment.id):
        request.tell(0.4)
    for simulator in client.simulators(experiment.id).itertuples():
        assert simulator.error == pytest.approx((simulator.squared_error / (2 + simulator.iteration)) ** 0.5)
    assert [point.error.n for point in client.misfit(experiment.id).points] == [1, 1, 1]


def test_a_driver_is_told_before_the_first_run_that_readings_are_needed(client: Client, store: Store) -> None:
    experiment = client.submit(SPEC | {"robot": "quadruped", "discrepancy": "readings", "reality": REALITY})
    compute(store)

    task = next(client.requests(experiment.id))

    assert task.sensors is not None
    assert (task.sensors.names[0], task.sensors.needed) == ("roll", True)
    assert "send a trace for each repeat, or let a driver return them" in task.request.needs
    assert task.request.expected[0].startswith("simulators expect ")


def test_the_take_of_a_dead_phone_is_ended_by_somebody_else_with_the_reason(client: Client, store: Store) -> None:
    experiment = submitted(client)
    compute(store)
    (request,) = client.bench.pending(experiment.id)
    path = f"/requests/{request.id}/release"
    taken = client._connection.post(RequestRead, f"/requests/{request.id}/take", {"operator": "Ada"})

    by = {"take": taken.takes, "operator": "Bea", "reason": "her phone is dead"}
    assert client._connection.change(RequestRead, "POST", path, json=by).state == "open"

    (event,) = client.events(follow=False, study=experiment.id, kind="released")
    assert {"by": "Bea", "operator": "Ada", "reason": "her phone is dead"}.items() <= event.body.items()
    late = client.bench.answer(request.id, [0.4], take=taken.takes)
    assert (late.state, late.operator) == ("counted", "Ada")


def test_what_two_programs_measured_at_once_does_not_count_by_itself(client: Client, store: Store) -> None:
    experiment = client.submit(SPEC | {"reality": REALITY, "repetitions": 3})
    compute(store)
    loop = client.requests(experiment.id)
    task = next(loop)
    task.note(0.1)
    fall_silent(store)
    _, second, third = client.bench.pending(experiment.id)
    for each in (second, third):
        taking.take(store, each.id, TakeSpec(operator="Bo"), FREELY)
        if each is second:
            counted = client.bench.answer(each, [0.5], take=1)
    with pytest.raises(TakeLost, match="take 1 of request"):
        task.take.ask()
    task.take._shown -= 600.0  # the lease, which nobody waited for: a slow answer is still within it

    mine = task.tell(0.4)

    other = client.bench.answer(third, [0.3], take=1)
    assert (mine.state, other.state) == ("conflict", "conflict")
    (doubt,) = client.bench.request(second).answers[0].doubts
    assert (counted.doubts, "had the robot too, and may have moved it" in doubt) == ((), True)
    loop.close()  # type: ignore[attr-defined]


def test_readings_of_numpy_are_stored_with_null_where_a_sensor_failed(
    client: Client, store: Store, tmp_path: Path
) -> None:
    reality = REALITY | {"repeats": 2}
    experiment = client.submit(SPEC | {"robot": "quadruped", "discrepancy": "readings", "reality": reality})
    compute(store)
    journal = tmp_path / "journal"
    loop = client.requests(experiment.id, journal=journal)
    task = next(loop)
    assert task.sensors is not None
    table = np.full((len(task.sensors.times_s), len(task.sensors.names)), 0.25, dtype=np.float32)

    for wrong, place in (((np.inf, table), "/values/0"), ((0.5, table * np.inf), "/readings/0/0")):
        with pytest.raises(ValueError, match=f"^{place}: must be a finite number, not inf"):
            task.note(*wrong)
    assert journal.read_bytes() == b""
    table[1] = np.nan
    half: Any = np.float32(0.5)
    task.note(half, table)
    del loop  # the driver dies
    loop = client.requests(experiment.id, journal=journal)
    task = next(loop)
    task.note(0.25, table)
    answer = task.tell([value for value, _ in task.known], [readings for _, readings in task.known])

    assert (answer.state, answer.values) == ("counted", (0.5, 0.25))
    assert answer.readings is not None
    assert [set(row) for row in answer.readings[0]] == [set(row) for row in answer.readings[1]]
    assert (set(answer.readings[0][0]), set(answer.readings[0][1])) == ({0.25}, {None})

    client.bench.correct(answer, [0.5, 0.26], reason="a slip")  # of the values alone

    (_, corrected) = client.bench.request(task.id).answers
    assert (corrected.values, corrected.readings) == ((0.5, 0.26), answer.readings)


@pytest.mark.usefixtures("computing")
def test_repeats_of_an_answer_with_a_mistake_are_not_lost(client: Client, tmp_path: Path) -> None:
    experiment = submitted(client, repeats=2)
    loop = client.requests(experiment.id, journal=tmp_path / "journal")
    task = next(loop)
    task.note(0.25)
    task.note(0.5)
    wrong: Any = [[0.25], [0.5]]
    with pytest.raises(TypeError, match=r"^/values/0: must be a number"):
        task.tell(wrong)
    with pytest.raises(ServiceError, match="2 values"):
        task.tell([0.25])
    del loop
    loop = client.requests(experiment.id, journal=tmp_path / "journal")
    again = next(loop)

    assert (again.id, again.known) == (task.id, [(0.25, None), (0.5, None)])
    assert again.tell([value for value, _ in again.known]).state == "counted"
    assert again.known == []


def test_no_sign_of_life_is_given_after_an_answer(client: Client, store: Store) -> None:
    experiment = submitted(client)
    compute(store)
    loop = client.requests(experiment.id)
    task = next(loop)
    assert [each.name for each in threads() if each.name == "heartbeat"] == ["heartbeat"]

    task.fail(RuntimeError(""))

    wait_until(lambda: not any(each.name == "heartbeat" for each in threads()))
    assert client.bench.request(task.id).answers[0].failed == "RuntimeError"


def test_a_driver_ends_at_once_where_no_gaplab_is() -> None:
    page = MockTransport(lambda _: Response(200, html="<p>welcome</p>"))
    with (
        Client("http://127.0.0.1:1", transport=page) as client,
        pytest.raises(ServiceUnreachable, match="is not gaplab"),
    ):
        next(client.requests("x"))


def test_an_answer_may_be_computed_from_traces(client: Client, store: Store, tmp_path: Path) -> None:
    physical = {"kind": "physical", "probes": "each", "repeats": 2}
    spec = SPEC | {"robot": "quadruped", "engine": "pybullet", "strategy": "random", "reality": physical}
    experiment = client.submit(spec)
    compute(store)
    (request,) = client.bench.pending(experiment.id)
    stored = [client.bench.attach(file) for file in traces_of(request.genome, tmp_path)]
    hashes = [each.id for each in stored]

    read = client.bench.traces(request, stored)
    assert [round(trace.lag_s, 1) for trace in read.traces] == [2.0, 7.5]
    assert all((trace.match or 0.0) > 0.3 for trace in read.traces)
    assert read.unit == "m/s"
    assert read.readings is not None
    assert client.bench.traces(request.id, hashes[:1]).values == read.values[:1]  # after the first run
    assert client.bench.pending(experiment.id)[0].answers == ()
    again = client.bench.traces(request.id, hashes, lags_s=[2.0, 7.5])
    assert again.values == pytest.approx(read.values, abs=0.02)
    assert again.values[0] == pytest.approx(again.values[1], abs=1e-6)

    answer = client.bench.answer(request.id, traces=stored, operator="Ada", unit="m/s")
    assert (answer.state, answer.values, answer.readings) == ("counted", read.values, read.readings)
    assert answer.attachments == tuple(hashes)
    assert [trace.lag_s for trace in answer.traces] == [trace.lag_s for trace in read.traces]
    assert client.bench.answer(request.id, traces=hashes, operator="Ada", unit="m/s").id == answer.id
    assert client.bench.request(request.id).answers == (answer,)


def test_a_trace_with_a_gap_is_refused_unless_it_is_confirmed(client: Client, store: Store, tmp_path: Path) -> None:
    physical = {"kind": "physical", "probes": "each"}
    spec = SPEC | {"robot": "quadruped", "engine": "pybullet", "strategy": "random", "reality": physical}
    experiment = client.submit(spec)
    compute(store)
    (request,) = client.bench.pending(experiment.id)
    whole, _ = traces_of(request.genome, tmp_path)
    assert client.bench.traces(request.id, [client.bench.attach(whole).id]).doubts == ()
    lines = whole.read_text().splitlines(keepends=True)
    whole.write_text("".join([*lines[:250], *lines[350:]]))
    holed = [client.bench.attach(whole).id]

    (doubt,) = client.bench.traces(request.id, holed).doubts
    with pytest.raises(ServiceError, match="send `confirmed` with them") as refused:
        client.bench.answer(request.id, traces=holed)
    answer = client.bench.answer(request.id, traces=holed, confirmed=True)

    assert doubt.startswith("trace 1: there is no row from ")
    assert doubt in str(refused.value)
    assert (refused.value.problem.status, answer.state) == (409, "counted")


@pytest.mark.usefixtures("computing")
def test_repeats_and_the_noise_are_shown(client: Client) -> None:
    known = [{"genome": [0.3], "values": [0.3, 0.5]}]
    experiment = submitted(client, repeats=2, samples=known)
    for request in client.requests(experiment.id):
        request.tell([0.4, 0.6])
    samples = client.samples(experiment.id)
    assert set(samples["repeats"]) == {2}
    assert samples["standard_error"].tolist() == pytest.approx([0.1] * len(samples))
    assert samples["fitness"].tolist() == [0.5] * len(samples)
    assert client.misfit(experiment.id).noise == pytest.approx(0.02**0.5)


def test_traces_of_earlier_runs_become_samples_without_a_request(tmp_path: Path) -> None:
    genome = Quadruped().known.tolist()
    whole, late = traces_of(genome, tmp_path)
    lines = late.read_text().splitlines()
    (tmp_path / "holed.csv").write_text("\n".join(lines[:150] + lines[200:]))
    table = tmp_path / "runs.csv"
    head = ",".join([*(f"gene_{place}" for place in range(len(genome))), "trace_1", "trace_2", "lag_s_2"])
    genes = ",".join(map(str, genome))

    table.write_text(f"{head}\n{genes},{whole.name},{late.name},7.5\n{genes},{whole.name},,\n")
    both, once = gaplab.read_samples(table, "quadruped")

    assert [len(both[part]) for part in ("values", "readings")] == [2, 2]
    assert both["values"] == pytest.approx([both["values"][0]] * 2, rel=0.02)
    assert (once["values"], once["readings"]) == (both["values"][:1], both["readings"][:1])
    reality = {"kind": "physical", "samples": [both, once]}
    resolve_experiment(ExperimentSpec.model_validate(SPEC | {"robot": "quadruped", "reality": reality}))

    table.write_text(f"{head}\n\n{genes},holed.csv,,\n{genes},none.csv,,\n")
    with pytest.raises(InvalidSamples) as refused:
        gaplab.read_samples(table, "quadruped")
    assert [(each.line, each.message[:33]) for each in refused.value.errors] == [
        (3, "ValueError: trace 1: there is no "),
        (4, "FileNotFoundError: [Errno 2] No s"),
    ]
    table.write_text(f"{head}\n{genes},holed.csv,,\n")
    assert len(gaplab.read_samples(table, "quadruped", confirmed=True)) == 1


def traces_of(genome: Any, folder: Path) -> Iterator[Path]:
    """Two recordings of a controller in reality, with clocks of their own."""
    import numpy as np

    from gaplab.services.core.arrays import frozen
    from gaplab.services.engines.pybullet.engine import PyBullet
    from gaplab.services.world.robots.quadruped import Quadruped

    robot, times = Quadruped(), frozen(np.arange(301) * 0.01)
    poses = PyBullet().record(robot.world, robot.motion(np.array(genome)), times).poses
    still = [poses[:1].repeat(100, axis=0), poses, poses[-1:].repeat(100, axis=0)]
    for name, lag_s in (("a", 2.0), ("b", 7.5)):
        clock = np.arange(501) * 0.01 - 1.0 + lag_s
        rows = np.column_stack([clock, np.vstack(still)])
        file = folder / f"{name}.csv"
        header = "time_s,x,y,z,qx,qy,qz,qw"
        np.savetxt(file, rows, delimiter=",", header=header, comments="")
        yield file


def test_traces_that_say_nothing_are_refused(client: Client, store: Store, tmp_path: Path) -> None:
    experiment = submitted(client, repeats=1)
    compute(store)
    (request,) = client.bench.pending(experiment.id)
    file = tmp_path / "trace.csv"
    file.write_text("time_s,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.5,1,0,0,0,0,0,1\n")
    short = client.bench.attach(file).id
    for traces, lags, said in [
        ([short], None, "the trace does not contain the motion: it lasts 0.5 s, and the motion 1 s"),
        (["0" * 64], None, "no attachment with this hash"),
        ([short, short], None, "an answer has one trace for each repeat: 1, not 2"),
        ([short], [0.0, 1.0], "there is one lag for each trace: 1, not 2"),
    ]:
        with pytest.raises(ServiceError, match=said):
            client.bench.traces(request.id, traces, lags)
    for both in ({"values": [0.5], "traces": [short]}, {"failed": "no", "traces": [short]}):
        with pytest.raises(ServiceError, match="either"):
            client.bench.answer(request.id, **both)
    file.write_text("time_s,x,y,z,qx,qy,qz,qw\n3,0,0,0,0,0,0,1\n5,1,0,0,0,0,0,1\n")
    assert client.bench.traces(request.id, [client.bench.attach(file).id]).values == (0.5,)
