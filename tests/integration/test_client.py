"""The client as programs and notebooks use it: frames, waiting, figures, errors; no line of it is HTTP to its user."""

import json
import sys
import threading
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import httpx2
import numpy as np
import pytest
from fastapi.testclient import TestClient

import gaplab
from gaplab import Client, ExperimentFailed, ExtraMissing, ServiceError, ServiceUnreachable
from gaplab.api.app import create_app
from gaplab.api.clients import results
from gaplab.schemas.access import Role
from gaplab.schemas.events import EventKind, EventRead
from gaplab.services import access
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Measured
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.running import execution
from gaplab.services.store.lease import Failure
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.session import Store
from gaplab.services.world import robot_library
from gaplab.services.world.robots.robot_file import Imported
from tests.experiments import run, some_log

SMALL = {"strategy": "random", "robot": "toy_function", "budget": "smoke", "repetitions": 3}
TIMES = ["repetition", "iteration", "kind", "time_s"]
BOTH = {"strategies": ["random", "direct"], "robot": "toy_function", "budget": "smoke", "repetitions": 3}


class InProcess(httpx2.BaseTransport):
    """The app in this process in place of the network; `lost` answers are served and then lost on the way."""

    def __init__(self, store: Store, rollouts: RolloutProcess | None = None) -> None:
        app = create_app(store)
        app.state.rollout_process = rollouts or app.state.rollout_process
        self._client = TestClient(app, raise_server_exceptions=False)
        self._process = app.state.rollout_process
        self.asked: list[str] = []
        self.lost = 0
        self.busy = 0
        self.status, self.retry_after = 503, "5"

    def close(self) -> None:
        self._process.close()

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        self.asked.append(f"{request.method} {request.url.path}")
        if self.busy:
            self.busy -= 1
            problem = {"type": "about:blank", "title": "t", "status": self.status, "detail": "busy"}
            return httpx2.Response(self.status, json=problem, headers={"Retry-After": self.retry_after})
        headers = {name: value for name, value in request.headers.items() if name != "host"}
        url = request.url.raw_path.decode()
        answer = self._client.request(request.method, url, content=request.read(), headers=headers)
        if self.lost:
            self.lost -= 1
            raise httpx2.ReadError("the answer was lost")
        decoded = {name: value for name, value in answer.headers.items() if name != "content-encoding"}
        return httpx2.Response(answer.status_code, headers=decoded, content=answer.content)


@pytest.fixture
def network(sqlite_store: Store) -> InProcess:
    return InProcess(sqlite_store)


@pytest.fixture
def client(network: InProcess) -> Iterator[Client]:
    with Client("http://127.0.0.1:1", transport=network, pauses_s=(0.0, 0.0, 0.0)) as found:
        yield found


def test_a_curve_is_a_frame_of_its_points_or_of_its_repetitions(client: Client, finish: Callable[[], None]) -> None:
    study = client.submit(BOTH)
    finish()

    points, values = client.curve(study.id), client.curve(study.id, each=True)

    (curve, direct) = client.curves([study.id])
    assert list(points["experiment"].unique()) == [each.id for each in study.experiments]
    assert len(points) == len(curve.points) + len(direct.points)
    assert points["mean"].iloc[0] == curve.points[0].mean
    assert points["evaluations"].dtype.kind == "i"
    assert len(values) == sum(len(point.values) for each in (curve, direct) for point in each.points)
    assert values.groupby(["experiment", "evaluations"])["fitness"].mean().notna().all()


def test_what_is_no_spec_is_not_sent(client: Client, network: InProcess) -> None:
    wrong: list[tuple[Any, str]] = [
        ("examples/smoke.json", "not 'examples/smoke.json'; read a file with json.loads"),
        (Path("smoke.json"), "smoke.json'.; read a file with json.loads"),
        ([], r"a spec is a dict, an ExperimentSpec or a StudySpec, not \[\]$"),
        (None, "not None$"),
    ]
    for spec, said in wrong:
        for send in (client.submit, client.estimate, client.check):
            with pytest.raises(TypeError, match=said):
                send(spec)

    assert network.asked == []


def test_an_id_that_is_no_text_is_named(client: Client) -> None:
    with pytest.raises(TypeError, match="an id or a name is a text, not 5"):
        client.experiment(5)  # type: ignore[arg-type]


def test_samples_come_whole_however_many_pages_they_are(
    client: Client, finish: Callable[[], None], network: InProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment = client.submit(SMALL)
    finish()
    whole = client.samples(experiment.id)
    monkeypatch.setattr(results, "PAGE", 2)
    network.asked.clear()

    by_twos = client.samples(experiment.id)

    assert by_twos.equals(whole)
    assert len(network.asked) == -(-len(whole) // 2)
    assert list(whole["kind"].unique()) == ["probe", "sample"]
    assert {"repetition", "iteration", "fitness", "measured_at", "gene_0"} <= set(whole)
    assert whole["fitness"].dtype == float
    only = client.samples(experiment.id, repetition=1, kind="sample")
    assert set(only["repetition"]) == {1}
    assert set(only["kind"]) == {"sample"}
    assert only["fitness"].isna().any()  # a measurement that failed


def test_simulators_are_a_frame_with_a_column_for_each_tunable(client: Client, finish: Callable[[], None]) -> None:
    experiment = client.submit(SMALL | {"tunables": ["static_friction", "restitution"]})
    finish()

    found = client.simulators(experiment.id)

    assert list(found) == [
        "repetition",
        "iteration",
        "rank",
        "squared_error",
        "error",
        "static_friction",
        "restitution",
    ]
    assert found["squared_error"].isna().any()  # infinite there, null on the wire
    assert set(client.simulators(experiment.id, iteration=0)["iteration"]) == {0}


def measured_by(client: Client, store: Store, robot: str) -> tuple[str, Any]:
    """The id of an experiment whose walk is rated for three seconds, and the 60 readings of its sample."""
    task = {"name": "walk", "options": {"settling_s": 1.0, "counted_s": 3.0}}
    spec = {"strategy": "random", "robot": robot, "task": task, "engine": "mujoco", "budget": "smoke", "iterations": 1}
    id = client.submit(spec | {"repetitions": 1}).id
    readings = np.where(np.arange(60.0) == 7, np.nan, np.arange(60.0))
    (claim,) = execution.claim(store, "me", 1)
    steps = (
        replace(step, sample=replace(step.sample, readings=frozen(readings))) if isinstance(step, Measured) else step
        for step in some_log(1)
    )
    run(store, claim, steps)
    return id, readings


@pytest.mark.parametrize("robot", ["quadruped", "walker"])
def test_readings_have_the_sensors_and_times_of_the_spec(
    client: Client, sqlite_store: Store, tmp_path: Path, robot: str
) -> None:
    example = robot_library.robot_file(Imported.example().options.sha256)
    assert example is not None
    file = tmp_path / "walker.json"
    file.write_text(json.dumps(example.content | {"name": "walker"}))
    client.add_robot(file)
    id, readings = measured_by(client, sqlite_store, robot)

    found = client.readings(id)

    values = readings.reshape(12, 5) * [0.02, 0.02, 0.005, 0.005, 0.005]
    assert list(found) == [*TIMES, "roll_rad", "pitch_rad", "height_m", "x_m", "y_m"]
    assert found["time_s"].tolist() == [1.25 + 0.25 * place for place in range(12)]
    np.testing.assert_array_equal(found.drop(columns=TIMES).to_numpy(), values)
    assert set(found["kind"]) == {"sample"}  # the probes have none


def test_readings_of_an_unknown_robot_are_refused_and_never_cut(client: Client, sqlite_store: Store) -> None:
    id, _ = measured_by(client, sqlite_store, "quadruped")

    def now_with(**changes: Any) -> None:
        with sqlite_store.transaction() as session:
            row = session.get_one(ExperimentRow, id)
            row.spec = row.spec | changes

    now_with(task={"name": "walk", "options": {"counted_s": 1.0}})  # as by a plug-in that was edited since
    with pytest.raises(ValueError, match="zip"):
        client.readings(id)
    now_with(task={"name": "gone", "options": {}})
    with pytest.raises(LookupError, match=f"the sensors of {id} are unknown: its robot or task is not installed"):
        client.readings(id)


def test_curves_are_asked_for_in_parts_that_the_service_takes_and_come_in_order(
    client: Client, finish: Callable[[], None], network: InProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = client.submit(BOTH)
    finish()
    whole = client.curves_csv([study.id])
    first, second = (each.id for each in study.experiments)
    monkeypatch.setattr(results, "MOST_CURVES", 1)
    network.asked.clear()

    curves = client.curves([second, study.experiments[0]])

    assert network.asked == ["GET /curves"] * 2
    assert [each.experiment for each in curves] == [second, first]
    assert client.curves_csv(study.experiments) == whole


def predictions(pending: int) -> httpx2.Response:
    """An answer of the service, with `pending` of two samples not computed yet."""
    items = [
        {"repetition": 0, "iteration": k, "simulated_before": None, "simulated_after": 0.5, "fitness": 0.4}
        for k in range(2 - pending)
    ]
    return httpx2.Response(200, json={"experiment": "e", "unit": "m/s", "items": items, "pending": pending})


def test_predictions_are_waited_for_until_none_is_pending() -> None:
    answers = [predictions(2), predictions(1), predictions(0)]
    network = httpx2.MockTransport(lambda _: answers.pop(0))

    with Client("http://127.0.0.1:1", transport=network) as client:
        found = client.predictions("e", every_s=0)

    assert answers == []
    assert len(found) == 2
    assert found["simulated_before"].dtype == float
    assert found["simulated_before"].isna().all()


def test_predictions_that_take_too_long_say_how_many_are_left() -> None:
    network = httpx2.MockTransport(lambda _: predictions(1))

    with (
        Client("http://127.0.0.1:1", transport=network) as client,
        pytest.raises(TimeoutError, match="1 predictions of e are not computed"),
    ):
        client.predictions("e", every_s=0, timeout_s=0)


def test_without_a_library_of_notebooks_the_message_is_the_line_that_installs_it(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    id = client.submit(SMALL).id
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)

    with pytest.raises(ExtraMissing, match=r"needs pandas, which is not installed: pip install 'gaplab\[notebook\]'"):
        client.curve(id)
    with pytest.raises(ExtraMissing, match=r"needs plotly, which is not installed: pip install 'gaplab\[notebook\]'"):
        client.figure(id).plotly()
    assert client.curves([id])


def test_programs_import_what_the_client_raises_from_where_it_is() -> None:
    raised = {"CommandError", "ExperimentFailed", "ExtraMissing", "ServiceError", "ServiceUnreachable"}

    assert raised < set(gaplab.__all__)
    assert [getattr(gaplab, name).__name__ for name in gaplab.__all__] == gaplab.__all__


def test_waiting_gives_what_it_ended_as(client: Client, finish: Callable[[], None]) -> None:
    experiment = client.submit(SMALL)
    worker = threading.Timer(0.3, finish)
    worker.start()

    ended = client.wait(experiment.id, every_s=0.1)

    worker.join()
    assert ended.id == experiment.id
    assert ended.state == "COMPLETED"


def test_waiting_shows_progress_on_standard_error_if_asked(
    client: Client, finish: Callable[[], None], capsys: pytest.CaptureFixture[str]
) -> None:
    study = client.submit(SMALL)
    finish()

    client.wait(study, progress=True)
    client.wait(study.id)

    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("COMPLETED") == 1


def test_waiting_for_what_fails_raises_with_its_reason(client: Client, sqlite_store: Store) -> None:
    experiment = client.submit(SMALL)
    for claim in execution.claim(sqlite_store, "test", limit=10):
        execution.fail(sqlite_store, claim, Failure("ValueError: the robot fell apart"))

    with pytest.raises(ExperimentFailed, match="ended as FAILED; ValueError: the robot fell apart") as failed:
        client.wait(experiment.id)

    assert failed.value.ended.id == experiment.id


def test_waiting_for_what_is_cancelled_raises_too(client: Client) -> None:
    study = client.submit(BOTH)
    client.cancel(study.id)

    with pytest.raises(ExperimentFailed, match="ended as CANCELLED"):
        client.wait(study.id)


def test_waiting_has_an_end_if_asked(client: Client) -> None:
    id = client.submit(SMALL).id

    with pytest.raises(TimeoutError, match=r"is QUEUED after 0\.1 s; it continues"):
        client.wait(id, timeout_s=0.1, every_s=0.1)


def test_a_notebook_gets_one_display_that_is_replaced(
    client: Client, finish: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []

    def update(html: Any) -> None:
        shown.append(html.data)
        finish()

    monkeypatch.setattr("IPython.get_ipython", lambda: SimpleNamespace(kernel=object()))
    monkeypatch.setattr("IPython.display.display", lambda _, display_id: SimpleNamespace(update=update))
    study = client.submit(BOTH | {"name": "a <b> & c"})

    client.wait(study.id, every_s=0.1)

    assert len(shown) > 1
    assert "QUEUED" in shown[0]
    assert shown[-1].count("COMPLETED") == 3
    assert "a &lt;b&gt; &amp; c" in shown[0]
    assert shown[-1].count("100 %") == 3


def test_a_figure_shows_itself_and_saves_itself_by_its_suffix(
    client: Client, finish: Callable[[], None], tmp_path: Any, network: InProcess
) -> None:
    study = client.submit(BOTH)
    finish()

    figure = client.figure(study.id, title="Mine")
    shown = figure._repr_mimebundle_()
    asked = len(network.asked)
    svg, html = figure.save(tmp_path / "new" / "mine.svg"), figure.save(str(tmp_path / "mine.HTML"))

    assert ET.fromstring(shown["image/svg+xml"]).tag.endswith("svg")
    assert svg.read_text() == shown["image/svg+xml"]
    assert "Mine" in html.read_text()
    assert len(network.asked) == asked + 1  # what was drawn is kept
    assert repr(figure) == f"<figure curves of {study.id}>" == shown["text/plain"]


def test_a_figure_can_be_gone_on_with_in_plotly(client: Client, finish: Callable[[], None]) -> None:
    study = client.submit(BOTH)
    finish()

    found = client.figure(study.id).plotly()

    assert found.data
    assert "evaluations" in found.layout.xaxis.title.text


def test_the_client_knows_which_kinds_of_figures_there_are(client: Client) -> None:
    assert "curves" in client.figure_kinds()


def test_a_figure_of_an_unknown_format_or_kind_or_id_is_a_sentence(client: Client, tmp_path: Any) -> None:
    id = client.submit(SMALL).id

    with pytest.raises(ValueError, match=r"mine.docx has another suffix; permitted: .svg, .png"):
        client.figure(id).save(tmp_path / "mine.docx")
    with pytest.raises(ServiceError) as unknown:
        client.figure(id, of="portrait").content("svg")
    with pytest.raises(ServiceError, match="there is no"):
        client.figure("nope").content("svg")

    assert unknown.value.problem.status == 404
    assert list(tmp_path.iterdir()) == []


def test_what_is_read_is_asked_for_again_if_the_answer_is_lost_or_the_service_busy(
    client: Client, network: InProcess
) -> None:
    id = client.submit(SMALL).id
    network.asked.clear()
    network.lost, network.busy = 1, 1

    assert client.experiment(id).id == id
    assert len(network.asked) == 3

    network.busy = 4
    with pytest.raises(ServiceError, match="busy"):
        client.experiment(id)


def test_what_is_submitted_while_answers_are_lost_exists_once(client: Client, network: InProcess) -> None:
    network.lost, network.busy = 2, 1

    submitted = client.submit(SMALL)

    assert [each.id for each in client.studies().items] == [submitted.id]


def test_a_verb_whose_answer_is_lost_is_not_asked_for_again(client: Client, network: InProcess) -> None:
    id = client.submit(SMALL).id
    network.asked.clear()
    handle = network.handle_request

    def lose_the_verb(request: httpx2.Request) -> httpx2.Response:
        network.lost = int(request.method == "POST")
        return handle(request)

    network.handle_request = lose_the_verb  # type: ignore[method-assign]
    with pytest.raises(ServiceUnreachable):
        client.cancel(id)

    assert [each for each in network.asked if each.startswith("POST")] == [f"POST /studies/{id}/cancel"]


def test_a_spec_with_several_mistakes_raises_with_a_line_for_each(client: Client) -> None:
    with pytest.raises(ServiceError) as refused:
        client.submit({"strategy": "simulated_fti", "robot": "quadruppet"})

    lines = sorted(str(refused.value).splitlines())
    assert [line.partition(":")[0] for line in lines] == ["/robot", "/strategy"]
    assert "did you mean 'simulated_fit'?" in lines[1]
    assert refused.value.problem.errors[0].nearest


def test_with_a_token_it_is_the_same_and_without_one_it_says_so(sqlite_store: Store, network: InProcess) -> None:
    secret = access.create_token(sqlite_store, Role.RUNNER, "me").secret

    with Client("http://gaplab.example", token=secret, transport=network) as mine:
        id = mine.submit(SMALL).id
        assert mine.samples(id).empty
        assert mine.curve(id)["mean"].isna().all()
    with Client("http://gaplab.example", transport=network) as nobody, pytest.raises(ServiceError, match="token") as no:
        nobody.submit(SMALL)
    assert no.value.problem.status == 401


def test_events_and_lists_are_values_that_json_can_hold(client: Client) -> None:
    study = client.submit(BOTH)

    kinds = [each.kind.value for each in client.events(follow=False, study=study.id, after=None)]

    assert kinds.count("submitted") == 2
    assert [each.number for each in client.events(follow=False, after=1)] == [2]
    assert json.dumps([each.model_dump(mode="json") for each in client.studies().items])


def test_a_read_waits_for_its_turn_and_a_submission_is_refused(client: Client, network: InProcess) -> None:
    network.busy, network.status, network.retry_after = 2, 429, "0"
    assert client.studies().items == ()

    network.busy = 1
    with pytest.raises(ServiceError, match="busy") as refused:
        client.submit(BOTH)

    assert refused.value.retry_after_s == 0.0
    assert len(network.asked) == 4


def test_a_slow_answer_is_told_apart_from_no_service_and_a_get_is_not_sent_again() -> None:
    timeouts = []

    def slow(request: httpx2.Request) -> httpx2.Response:
        timeouts.append((request.method, request.extensions["timeout"]["read"]))
        raise httpx2.ReadTimeout("slow", request=request)

    network = httpx2.MockTransport(slow)
    with Client("http://gaplab.example", transport=network, pauses_s=(0.0,), timeout_s=7) as client:
        with pytest.raises(ServiceUnreachable, match=r"the service at \S+ has not answered within 7 s$"):
            client.catalogue()
        with pytest.raises(ServiceUnreachable, match="not answered within 67 s"):
            client.bench.pending(wait_s=60.0)
        with pytest.raises(ServiceUnreachable, match="not answered within 7 s"):
            client.submit(SMALL)

    assert timeouts == [("GET", 7), ("GET", 67), ("POST", 7), ("POST", 7)]


def test_what_cannot_be_unpacked_is_no_answer() -> None:
    network = httpx2.MockTransport(lambda _: httpx2.Response(200, headers={"Content-Encoding": "gzip"}, content=b"no"))

    with Client("http://gaplab.example", transport=network, pauses_s=()) as client:
        with pytest.raises(ServiceUnreachable, match="no service answers"):
            client.catalogue()
        with pytest.raises(ServiceUnreachable, match="no service answers"):
            next(client.events(patience_s=-1))


def test_events_of_what_is_no_gaplab_are_not_waited_for() -> None:
    network = httpx2.MockTransport(lambda _: httpx2.Response(200, html="<p>hello</p>"))

    with (
        Client("http://gaplab.example", transport=network) as client,
        pytest.raises(ServiceUnreachable, match="is not gaplab of this version"),
    ):
        next(client.events())


def test_kinds_of_figures_of_what_is_no_gaplab_are_a_sentence() -> None:
    answers = ["{}", "[]", "null", '{"paths": null}', "<p>hello</p>"]
    network = httpx2.MockTransport(lambda _: httpx2.Response(200, text=answers.pop()))

    with Client("http://gaplab.example", transport=network) as client:
        while answers:
            with pytest.raises(ServiceUnreachable, match="is not gaplab of this version"):
                client.figure_kinds()


def test_a_stream_that_had_nothing_to_tell_for_long_is_resumed_when_it_breaks() -> None:
    event = EventRead(number=7, kind=EventKind.STARTED, experiment="e", body={}, at=datetime.now(UTC))

    def quiet() -> Iterator[bytes]:
        for _ in range(3):
            time.sleep(0.1)
            yield b": still here\n\n"
        msg = "it broke"
        raise httpx2.ReadError(msg)

    bodies: list[Iterable[bytes]] = [quiet(), f"data: {event.model_dump_json()}\n\n".encode().splitlines(keepends=True)]
    network = httpx2.MockTransport(
        lambda _: httpx2.Response(200, headers={"Content-Type": "text/event-stream"}, content=bodies.pop(0))
    )

    with Client("http://gaplab.example", transport=network) as client:
        assert next(client.events(patience_s=0.15, retry_s=0.01)) == event
