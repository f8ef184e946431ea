"""What /docs says: every endpoint, with an example that is true, and without the internet."""

import re
from collections.abc import Iterator
from pathlib import Path
from secrets import token_hex
from typing import Any

import pytest
from fastapi.testclient import TestClient
from jsonschema import Draft202012Validator
from referencing import Registry, Resource
from referencing.jsonschema import DRAFT202012

from gaplab.api.app import create_app
from gaplab.schemas.measurements import MeasurementSpec, TakeSpec
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.spec import BudgetSpec, ExperimentSpec, RealitySpec
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import answering, taking
from gaplab.services.measuring.taking import RequestFilter
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.experiments import cancel, listed, run, submit_one, toy
from tests.integration.test_bench_safety import ask

METHODS = {"get", "post", "put", "patch", "delete"}
ENDPOINTS = {
    "GET /attachments/{id}",
    "GET /experiments/{id}/branches",
    "GET /experiments/{id}/takehome",
    "GET /requests",
    "GET /requests/{id}",
    "GET /requests/{id}/motion",
    "POST /attachments",
    "POST /measurements/{id}/corrections",
    "POST /measurements/{id}/decision",
    "POST /measurements/{id}/void",
    "POST /requests/{id}/heartbeat",
    "POST /requests/{id}/measurements",
    "POST /requests/{id}/release",
    "POST /requests/{id}/reopen",
    "POST /requests/{id}/take",
    "POST /requests/{id}/doubts",
    "POST /requests/{id}/traces",
    "POST /samples/check",
    "POST /robots",
    "GET /pools",
    "POST /pools",
    "GET /robots",
    "GET /robots/{robot}",
    "POST /studies",
    "POST /studies/estimate",
    "GET /studies/{id}/spec",
    "GET /studies",
    "GET /studies/{id}",
    "POST /experiments",
    "GET /experiments/{id}",
    "GET /experiments/{id}/repetitions",
    "GET /experiments/{id}/samples",
    "GET /experiments/{id}/simulators",
    "GET /experiments/{id}/misfit",
    "GET /experiments/{id}/predictions",
    "GET /experiments/{id}/replay",
    "GET /experiments/{id}/repetitions/{number}/attempts",
    "POST /studies/{id}/pause",
    "POST /studies/{id}/resume",
    "POST /studies/{id}/stop",
    "GET /experiments/{id}/provenance",
    "POST /studies/{id}/accept-versions",
    "GET /events",
    "GET /events/page",
    "PATCH /studies/{id}",
    "POST /studies/{id}/cancel",
    "POST /studies/{id}/retry",
    "POST /studies/{id}/extend",
    "PATCH /studies/{id}/schedule",
    "GET /experiments/{id}/curve",
    "GET /curves",
    "GET /comparisons",
    "GET /differences",
    "GET /studies/{id}/report",
    "GET /figures/curves",
    "GET /figures/coordinates",
    "GET /figures/simulators",
    "GET /figures/predictions",
    "GET /figures/squared-error",
    "GET /figures/gait",
    "GET /figures/readings",
    "GET /figures/toy",
    "POST /sensitivity",
    "GET /sensitivity/{id}",
    "GET /studies/{id}/export",
    "POST /import",
    "GET /catalogue",
    "GET /catalogue/robots/{name}/shapes",
    "GET /livez",
    "GET /readyz",
    "GET /metrics",
    "DELETE /studies/{id}/webhook",
    "DELETE /studies/{id}",
    "DELETE /views/{name}",
    "GET /studies/{id}/notes",
    "GET /studies/{id}/webhook",
    "GET /views",
    "GET /views/{name}",
    "POST /studies/{id}/archive",
    "POST /studies/{id}/unarchive",
    "PUT /studies/{id}/webhook",
    "PUT /views/{name}",
}

OPERATIONS = {
    "answer_request",
    "check_samples",
    "correct_measurement",
    "decide_measurement",
    "check_answer",
    "evaluate_traces",
    "keep_request",
    "list_branches",
    "list_requests",
    "read_attachment",
    "read_motion",
    "read_request",
    "release_request",
    "reopen_request",
    "store_attachment",
    "take_home",
    "take_request",
    "void_measurement",
    "submit_study",
    "estimate_study",
    "read_spec",
    "list_studies",
    "read_study",
    "edit_study",
    "submit_experiment",
    "read_experiment",
    "list_repetitions",
    "list_samples",
    "list_simulators",
    "read_misfit",
    "read_predictions",
    "read_replay",
    "read_curve",
    "read_curves",
    "compare_experiments",
    "draw_coordinates",
    "draw_curves",
    "draw_simulators",
    "draw_predictions",
    "draw_squared_error",
    "draw_gait",
    "draw_readings",
    "read_spec_differences",
    "report_study",
    "draw_toy",
    "submit_sensitivity",
    "read_sensitivity",
    "read_catalogue",
    "read_robot_shapes",
    "live",
    "ready",
    "add_pool",
    "list_pools",
    "add_robot",
    "list_robots",
    "read_robot",
    "accept_versions",
    "cancel_study",
    "export_study",
    "extend_study",
    "import_archive",
    "list_attempts",
    "list_events",
    "pause_study",
    "read_metrics",
    "read_provenance",
    "resume_study",
    "retry_study",
    "schedule_study",
    "stop_study",
    "stream_events",
    "archive_study",
    "delete_study",
    "delete_view",
    "drop_webhook",
    "list_views",
    "read_notes",
    "read_webhook",
    "read_view",
    "save_view",
    "set_webhook",
    "unarchive_study",
}


@pytest.fixture(scope="module")
def api(sqlite_template: Path) -> Iterator[TestClient]:
    store = Store(f"sqlite:///{sqlite_template}")
    yield TestClient(create_app(store))
    store.dispose()


@pytest.fixture(scope="module")
def document(api: TestClient) -> dict[str, Any]:
    return api.get("/openapi.json").json()


def operations(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            if method in METHODS:
                yield f"{method.upper()} {path}", operation


def complaints(document: dict[str, Any], schema: dict[str, Any], value: object) -> list[str]:
    whole = Resource(contents=document, specification=DRAFT202012)  # type: ignore[call-arg]
    registry = Registry().with_resource("urn:api", whole)
    pointed = _absolute(schema)
    return [each.message for each in Draft202012Validator(pointed, registry=registry).iter_errors(value)]


def _absolute(schema: Any) -> Any:
    if isinstance(schema, dict):
        return {key: f"urn:api{value}" if key == "$ref" else _absolute(value) for key, value in schema.items()}
    return [_absolute(each) for each in schema] if isinstance(schema, list) else schema


def example_of(document: dict[str, Any], schema: dict[str, Any], place: str) -> Any:
    """Put an example of a whole answer together from those of its fields, as `/docs` does."""
    match schema:
        case {"examples": [found, *_]} | {"default": found} | {"enum": [found, *_]}:
            pass
        case {"$ref": str(address)}:
            name = address.rpartition("/")[2]
            found = example_of(document, document["components"]["schemas"][name], name)
        case {"anyOf": [first, *_]}:
            found = example_of(document, first, place)
        case {"properties": parts}:
            found = {name: example_of(document, part, f"{place}.{name}") for name, part in parts.items()}
        case {"items": part}:
            found = [example_of(document, part, place)] * schema.get("minItems", 1)
        case _:
            assert schema.get("type") in {"integer", "boolean"}, f"{place} has no example"
            found = 0 if schema["type"] == "integer" else False
    return found


def test_every_endpoint_is_documented_and_no_other(document: dict[str, Any]) -> None:
    assert {name for name, _ in operations(document)} == ENDPOINTS


def test_operations_have_short_names_of_their_own_and_summaries(document: dict[str, Any]) -> None:
    names = [operation["operationId"] for _, operation in operations(document)]

    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)*", name) and len(name) < 25 for name in names)
    assert all(operation["summary"] and operation["description"] for _, operation in operations(document))


def test_operations_keep_the_names_that_generated_clients_call_them_by(document: dict[str, Any]) -> None:
    assert {operation["operationId"] for _, operation in operations(document)} == OPERATIONS


def test_every_operation_says_which_token_it_wants_and_links_lead_to_operations(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        open_ = name in {"GET /livez", "GET /readyz"}
        assert operation["security"] == ([] if open_ else [{"token": []}, {}]), name
        assert ({"401", "403"} <= operation["responses"].keys()) is not open_, name
        for answer in operation["responses"].values():
            assert {each["operationId"] for each in answer.get("links", {}).values()} <= OPERATIONS
    assert document["components"]["securitySchemes"]["token"]["scheme"] == "bearer"


def test_every_answer_has_an_example_that_fits_its_schema(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        success = next(answer for status, answer in operation["responses"].items() if status.startswith("2"))
        for media, content in success["content"].items():
            if name.endswith("/catalogue"):
                continue
            example = content.get("example") or example_of(document, content["schema"], name)
            assert complaints(document, content["schema"], example) == [], (name, media)


def test_every_example_of_a_spec_is_accepted(document: dict[str, Any], sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store))
    for name, operation in operations(document):
        if name.startswith("POST") and "application/json" in operation.get("requestBody", {}).get("content", {}):
            examples = operation["requestBody"]["content"]["application/json"]["examples"]
            method, path = name.split()
            for example in examples.values():
                if operation["operationId"] == "evaluate_traces":
                    continue  # its example names files that only a robot's motion makes
                address = path.format(id=_subject(sqlite_store, path)) if "{id}" in path else path
                answer = api.request(method, address, json=example["value"])
                if answer.status_code == 422 and "confirm_cost=true" in answer.text:  # the paper's figure
                    answer = api.request(method, address, json=example["value"], params={"confirm_cost": True})
                assert answer.is_success, (name, example, answer.text)


def _subject(store: Store, path: str) -> str:
    """The id of what the examples of a path are about, when nothing else is queued."""
    for each in listed(store):
        if not each.state.ended:
            cancel(store, each.id)
    if not path.startswith(("/requests", "/measurements")):
        return _completed(store)
    request = _waiting(store)
    if path == "/requests/{id}/take":
        return request
    taking.take(store, request, TakeSpec(operator="Ada"), FREELY)
    if path.startswith("/requests"):
        return request
    given = [
        answering.answer(store, request, MeasurementSpec(take=1, values=(value, 0.44, 0.4)), FREELY).answer.id
        for value in ((4.4, 0.41) if path.endswith("/decision") else (4.4,))
    ]
    return given[-1]  # a second is in conflict with the first


def _waiting(store: Store) -> str:
    """The id of a request for three repeats of a quadruped's motion."""
    spec = ExperimentSpec(
        strategy=PluginRef(name="random"),
        engine=PluginRef(name="mujoco"),
        iterations=1,
        repetitions=1,
        priority=10,
        budget=BudgetSpec(controller_evaluations=20, selection_evaluations=20, simulator_evaluations=20),
        reality=RealitySpec(kind="physical", repeats=3, probes="each", bench=token_hex(4)),
    )
    experiment = submit_one(store, spec).id
    ask(store)
    (request,) = taking.list_requests(store, RequestFilter(experiment)).items
    return request.id


def _completed(store: Store) -> str:
    """The id of a study of one."""
    made = submit_one(store, toy(repetitions=1))
    run(store, *execution.claim(store, "me", 1))  # type: ignore[arg-type]
    return made.id


def test_every_error_is_documented_as_a_problem(document: dict[str, Any]) -> None:
    for name, operation in operations(document):
        for status, answer in operation["responses"].items():
            if status[0] in "45":
                assert list(answer["content"]) == ["application/problem+json"], (name, status)
    assert "HTTPValidationError" not in str(document)


def test_what_takes_json_says_what_it_answers_to_anything_else(document: dict[str, Any]) -> None:
    bodies = {
        operation["operationId"]: operation["responses"]
        for operations in document["paths"].values()
        for operation in operations.values()
        if "application/json" in operation.get("requestBody", {}).get("content", {})
    }

    assert {"extend_study", "schedule_study", "submit_study"} <= set(bodies)
    assert [name for name, answers in bodies.items() if "415" not in answers] == []


def test_a_key_is_offered_where_it_is_heeded(document: dict[str, Any]) -> None:
    keyed = {
        operation["operationId"]
        for operations in document["paths"].values()
        for operation in operations.values()
        if "Idempotency-Key" in {each["name"] for each in operation.get("parameters", ())}
    }

    submitting = {"submit_experiment", "submit_study", "submit_sensitivity"}
    of_bench = {"take_request", "answer_request", "correct_measurement", "void_measurement", "decide_measurement"}
    assert keyed == submitting | of_bench


def test_real_answers_fit_their_documented_schema(document: dict[str, Any], sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store))
    made = api.post("/studies", json={"robot": "toy_function", "budget": "smoke"}).json()
    experiment = made["experiments"][0]
    ids = {"studies": made["id"], "experiments": experiment["id"], "sensitivity": experiment["sensitivity"]}
    ids["requests"] = _waiting(sqlite_store)
    without_json = ("/export", "/replay", "/takehome", "/attachments/{id}")
    for name, operation in operations(document):
        if name.startswith("GET") and "{id}" in name and not name.endswith(without_json):
            path = name.split()[1].format(id=ids[name.split("/")[1]], number=0)
            path += "?format=json" if name.endswith(("/report", "/motion")) else ""
            schema = operation["responses"]["200"]["content"]["application/json"]["schema"]
            assert complaints(document, schema, api.get(path).json()) == [], name


def test_the_pages_load_everything_from_the_service_itself(api: TestClient) -> None:
    for page in ("/docs", "/redoc"):
        answer = api.get(page)

        assert answer.status_code == 200
        assert "//" not in re.sub(r"<!--.*?-->", "", answer.text).replace("http://www.w3.org", "")
        sources = re.findall(r'(?:src|href)="\.(/[^"]+)"', answer.text)
        assert sources
        assert {source: api.get(source).status_code for source in sources} == dict.fromkeys(sources, 200)


def test_the_page_of_the_service_leads_to_its_documentation(api: TestClient) -> None:
    assert 'href="docs"' in api.get("/").text
    assert "swagger" in api.get("/docs").text
