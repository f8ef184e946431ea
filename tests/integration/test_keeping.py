"""Tags, archived records, deletion, saved views and notes: what people do with results once they have them."""

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from inspect import unwrap
from io import BytesIO
from time import sleep
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import func, select, update

from gaplab.api.app import create_app
from gaplab.schemas.access import Role
from gaplab.schemas.editing import DeletionRead, ViewSpec
from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import ExtensionSpec, State, Verb
from gaplab.schemas.spec import StudySpec
from gaplab.services import access, events
from gaplab.services.archives import export, import_archive
from gaplab.services.archives.writing import Archive
from gaplab.services.core.errors import Conflict, Forbidden, NotFound
from gaplab.services.events import WantedEvents
from gaplab.services.experiments import editing, lifecycle, listing, reading, submission
from gaplab.services.experiments.editing import Deleter, render
from gaplab.services.experiments.lifecycle import extend
from gaplab.services.running import execution
from gaplab.services.store.clock import moment
from gaplab.services.store.lease import Failure
from gaplab.services.store.models import Base, RepetitionRow, ViewRow
from gaplab.services.store.session import Store
from tests.experiments import cancel, run, some_log, submit_one, toy

ME = Deleter(None)
STUDY = {
    "strategies": ["random", "known_fit"],
    "robot": "toy_function",
    "tunables": ["static_friction", "dynamic_friction"],
    "budget": "smoke",
    "iterations": 1,
    "repetitions": 1,
}


@pytest.fixture
def api(sqlite_store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(sqlite_store)) as client:
        yield client


def study(store: Store, **changes: Any) -> Any:
    return submission.submit(store, StudySpec.model_validate(STUDY | changes))


def finish(store: Store, **log: Any) -> None:
    """Complete everything that is queued."""
    while claims := execution.claim(store, "me", 10):
        for claim in claims:
            run(store, claim, some_log(claim.spec.iterations, **log))


def rows(store: Store) -> dict[str, int]:
    with store.reading() as session:
        return {
            name: session.execute(select(func.count()).select_from(table)).scalar_one()
            for name, table in Base.metadata.tables.items()
        }


def content(archive: Archive) -> bytes:
    with archive.file:
        return archive.file.read()


def kinds(store: Store, **which: Any) -> list[EventKind]:
    return [event.kind for event in events.page(store, 0, WantedEvents(**which), limit=1000).items]


def test_tags_are_added_removed_and_replaced_without_others(api: TestClient) -> None:
    made = api.post("/experiments", json=toy().model_dump(mode="json", exclude_unset=True)).json()
    path, any_ = f"/studies/{made['id']}", {"If-Match": "*"}

    def tags(**change: Any) -> Any:
        return api.patch(path, json=change, headers=any_).json().get("tags")

    assert api.get(path).json()["tags"] == []
    assert tags(tags=["Gait", "b", "gait"]) == ["b", "gait"]
    assert tags(add_tags=["paper", "ÄRGER"], remove_tags=["b", "never"]) == ["gait", "paper", "ärger"]
    assert tags(name="other") == ["gait", "paper", "ärger"]
    assert tags(tags=[]) == []
    refused = api.patch(path, json={"tags": ["two words"]}, headers=any_)
    assert (refused.status_code, refused.json()["errors"][0]["pointer"]) == (422, "/tags/0")
    for change in ({"tags": None}, {"tags": [], "add_tags": ["a"]}, {"tags": [f"t{n}" for n in range(21)]}):
        assert api.patch(path, json=change, headers=any_).status_code == 422
    tags(tags=[f"t{number}" for number in range(20)])
    full = api.patch(path, json={"add_tags": ["one-more"]}, headers=any_)
    assert (full.status_code, full.json()["errors"][0]["pointer"]) == (422, "/add_tags")
    assert kinds(api.app.state.store).count(EventKind.EDITED) == 5  # type: ignore[attr-defined]


def test_archiving_and_back_changes_nothing_else_and_each_is_one_event(store: Store) -> None:
    made = study(store)
    finish(store)
    before = reading.read(store, made.id)

    for _ in range(2):
        archived = editing.archive(store, made.id)
    for _ in range(2):
        shown = editing.archive(store, made.id, archived=False)

    assert archived.archived_at is not None
    assert shown == before
    assert kinds(store)[-4:] == [EventKind.ARCHIVED] * 2 + [EventKind.UNARCHIVED] * 2


def test_only_what_has_ended_is_archived_and_what_goes_on_is_shown_again(store: Store) -> None:
    made = study(store)
    first, second = (each.id for each in made.experiments)
    with pytest.raises(Conflict, match="is QUEUED and cannot be archived: wait for its end"):
        editing.archive(store, made.id)
    finish(store)
    editing.archive(store, made.id)

    extend(store, first, ExtensionSpec(repetitions=2))

    assert reading.read(store, made.id).archived_at is None
    with pytest.raises(Conflict, match="this request is about all of it: use the id of the study"):
        editing.archive(store, second)


@pytest.mark.dialects
def test_a_deleted_study_leaves_nothing_but_its_events_and_what_others_share(store: Store) -> None:
    kept = submit_one(store, toy(name="kept", repetitions=1))
    finish(store)
    with_one = rows(store)
    made = study(store)
    finish(store)
    lasting = {"event", "event_counter", "deletion", "sensitivity", "provenance"}

    deleted = editing.delete(store, made.id, ME)

    after = rows(store)
    assert {name: count for name, count in after.items() if name not in lasting} == {
        name: count for name, count in with_one.items() if name not in lasting
    }
    assert (after["deletion"], after["provenance"]) == (3, with_one["provenance"])
    assert editing.delete(store, made.id, ME) == deleted
    assert rows(store) == after
    assert reading.read_experiment(store, kept.id).state is State.COMPLETED
    with pytest.raises(NotFound, match=rf"'study' \({made.id}\) was deleted at"):
        reading.read(store, made.id)


def test_events_of_the_deleted_stay_in_order_and_can_be_asked_for(store: Store) -> None:
    made = study(store)
    finish(store)
    number = events.latest(store)
    editing.delete(store, made.id, ME)
    page = events.page(store, 0, WantedEvents(study=made.id), limit=1000)
    of_one = events.page(store, number, WantedEvents(study=made.experiments[0].id), limit=10)

    assert [event.number for event in page.items] == list(range(1, number + 3))
    assert [event.kind for event in page.items[-2:]] == [EventKind.DELETED] * 2
    assert {event.study for event in page.items} == {made.id}
    assert [event.body for event in of_one.items] == [{"name": "random"}]
    events.check(store, WantedEvents(study=made.id), number)
    events.check(store, WantedEvents(study=made.experiments[0].id))


def test_nothing_is_deleted_that_is_under_way_or_holds_hardware(store: Store) -> None:
    made = submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)

    with pytest.raises(Conflict, match="is RUNNING and cannot be deleted: cancel it first"):
        editing.delete(store, made.id, ME)
    cancel(store, made.id)
    with store.transaction() as session:
        session.execute(update(RepetitionRow).values(hardware="arm"))
    with pytest.raises(Conflict, match="still holds hardware"):
        editing.delete(store, made.id, ME)
    execution.free_hardware(store, [claim])
    editing.delete(store, made.id, ME)

    with pytest.raises(NotFound):
        lifecycle.ask(store, made.id, Verb.RETRY)


def test_a_worker_that_has_not_heard_of_the_deletion_writes_into_no_other_experiment(store: Store) -> None:
    made = submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)
    cancel(store, made.id)
    editing.delete(store, made.id, ME)
    other = submit_one(store, toy(repetitions=1))
    (theirs,) = execution.claim(store, "you", 1)

    assert theirs.id != claim.id
    assert not execution.record(store, claim, next(some_log()))
    assert execution.heartbeat(store, [claim]) == ()
    assert execution.complete(store, claim) == ()
    assert execution.hand_back(store, claim) == ()
    assert not execution.fail(store, claim, Failure("late"))
    assert reading.list_repetitions(store, other.id)[0].state is State.RUNNING


def test_the_last_experiment_of_a_study_takes_it_along(store: Store) -> None:
    made = study(store)
    finish(store)
    first, second = (each.id for each in made.experiments)

    one = editing.delete(store, first, ME)

    assert (one.id, one.study) == (first, made.id)
    assert [each.id for each in reading.read(store, made.id).experiments] == [second]
    assert editing.delete(store, second, ME).id == second
    with pytest.raises(NotFound, match="was deleted at"):
        reading.read(store, made.id)
    assert editing.delete(store, made.id, ME).study is None


def deleted_during(store: Store, before: str, after: str) -> Future[DeletionRead]:
    """Delete something in a transaction that has not ended when the other deletion begins; return that."""
    with ThreadPoolExecutor(1) as pool:
        with store.transaction() as session:
            unwrap(editing.delete)(session, before, ME)
            later = pool.submit(editing.delete, store, after, ME)
            wait([later], timeout=0.5)
        return later


@pytest.mark.dialects
def test_two_deletions_at_the_same_time_leave_no_study_without_experiments(store: Store) -> None:
    made = study(store)
    finish(store)
    first, second = (each.id for each in made.experiments)

    later = deleted_during(store, first, second)

    assert later.result().id == second
    with pytest.raises(NotFound):
        reading.read(store, made.id)


@pytest.mark.dialects
@pytest.mark.parametrize(
    ("before", "after"), [("experiment", "experiment"), ("experiment", "study"), ("study", "experiment")]
)
def test_what_is_deleted_twice_at_the_same_time_is_deleted_once(store: Store, before: str, after: str) -> None:
    made = study(store)
    finish(store)
    ids = {"study": made.id, "experiment": made.experiments[0].id}

    later = deleted_during(store, ids[before], ids[after])

    assert later.result().id == ids[after]
    assert rows(store)["deletion"] == (1 if before == after else 3)


def test_an_archive_of_the_deleted_brings_it_back_under_its_id(store: Store) -> None:
    made = study(store)
    finish(store)
    archive = content(export(store, made.id))
    editing.delete(store, made.id, ME)

    imported = import_archive(store, BytesIO(archive))

    assert (imported.study, imported.renamed) == (made.id, {})
    assert content(export(store, made.id)) == archive
    assert reading.read(store, made.id).state is State.COMPLETED
    editing.delete(store, made.id, ME)


def test_tags_travel_in_archives_and_hiding_does_not(store: Store, api: TestClient) -> None:
    made = submit_one(store, toy(repetitions=1))
    finish(store)
    client = TestClient(create_app(store))
    client.patch(f"/studies/{made.id}", json={"tags": ["gait", "b"]}, headers={"If-Match": "*"})
    editing.archive(store, made.id)

    imported = import_archive(store, BytesIO(content(export(store, made.id))))

    arrived = reading.read(store, imported.study)
    assert (arrived.tags, arrived.archived_at) == (("b", "gait"), None)


def test_a_token_deletes_what_it_submitted_and_an_admin_everything(sqlite_store: Store) -> None:
    tokens = {
        name: access.create_token(sqlite_store, role)
        for name, role in {"ann": Role.RUNNER, "bob": Role.RUNNER, "reader": Role.READER, "admin": Role.ADMIN}.items()
    }
    app = create_app(sqlite_store)

    def as_(name: str) -> TestClient:
        return TestClient(app, headers={"Authorization": f"Bearer {tokens[name].secret}"})

    made = as_("ann").post("/studies", json=STUDY).json()["id"]
    path = f"/studies/{made}"
    as_("ann").post(f"{path}/cancel")

    assert as_("reader").delete(path).status_code == 403
    refused = as_("bob").delete(path)
    assert (refused.status_code, "submitted with another token" in refused.json()["detail"]) == (403, True)
    assert as_("bob").post(f"{path}/archive").status_code == 200
    assert as_("bob").get(path).status_code == 200
    assert as_("ann").delete(path).json()["id"] == made
    assert as_("ann").delete(path).status_code == 200
    assert as_("ann").delete("/studies/nobody").status_code == 404

    other = as_("ann").post("/studies", json=STUDY).json()["id"]
    as_("ann").post(f"/studies/{other}/cancel")
    assert as_("admin").delete(f"/studies/{other}").status_code == 200


def test_what_an_open_service_stored_only_an_admin_deletes_once_there_are_tokens(sqlite_store: Store) -> None:
    made = submit_one(sqlite_store, toy())
    cancel(sqlite_store, made.id)

    with pytest.raises(Forbidden):
        editing.delete(sqlite_store, made.id, Deleter("a token"))
    editing.delete(sqlite_store, made.id, Deleter("an admin's", may_delete_all=True))


@pytest.mark.dialects
def test_a_view_that_two_save_at_the_same_time_is_that_of_the_second(store: Store) -> None:
    with ThreadPoolExecutor(1) as pool:
        with store.transaction() as session:
            session.add(ViewRow(name="mine", sort="name", created_at=moment(session)))
            session.flush()
            second = pool.submit(listing.save_view, store, "mine", ViewSpec(query="strategy = random"))
            sleep(1.0)  # until it waits for this one
        saved = second.result()

    assert saved.query == "strategy = random"
    assert listing.list_views(store) == (saved,)


def test_saved_views_are_shared_replaced_and_deleted(api: TestClient) -> None:
    best = {"query": "strategy = informative and fitness > 0.5", "sort": "name"}

    saved = api.put("/views/slippery gaits", json=best)
    api.put("/views/all", json={})

    assert saved.status_code == 200
    assert [view["name"] for view in api.get("/views").json()] == ["all", "slippery gaits"]
    assert api.get("/views/slippery gaits").json() == saved.json()
    assert api.put("/views/all", json={"query": "archived = true"}).json()["query"] == "archived = true"
    assert api.delete("/views/all").status_code == 200
    assert api.delete("/views/all").status_code == 404
    assert api.get("/views/all").status_code == 404


def test_a_view_is_checked_when_it_is_saved(api: TestClient) -> None:
    wrong: list[tuple[str, dict[str, str], str]] = [
        ("a", {"query": "strategi = x"}, "/query"),
        ("a", {"query": "state ="}, "/query"),
        ("a", {"sort": "progress"}, "/sort"),
        ("a<b", {}, "name"),
        ("x" * 61, {}, "name"),
    ]
    refused = [api.put(f"/views/{name}", json=body) for name, body, _ in wrong]

    assert {each.status_code for each in refused} == {422}
    assert [each.json()["errors"][0]["pointer"] for each in refused] == [pointer for *_, pointer in wrong]


def test_lists_are_queried_over_http_and_a_mistake_is_a_problem(api: TestClient) -> None:
    api.post("/studies", json=STUDY | {"name": "slippery"})

    assert len(api.get("/studies", params={"q": "strategy = random"}).json()["items"]) == 1
    assert len(api.get("/studies", params={"q": "slip"}).json()["items"]) == 1
    problem = api.get("/studies", params={"q": "strategi = random"}).json()
    assert problem["status"] == 422
    assert problem["errors"][0]["nearest"] == "strategy"


HARMLESS = {
    "*soft* and `code`": "<p><em>soft</em> and <code>code</code></p>\n",
    "<script>alert(1)</script>": "<p>&lt;script&gt;alert(1)&lt;/script&gt;</p>\n",
    "<img src=x onerror=alert(1)>": "<p>&lt;img src=x onerror=alert(1)&gt;</p>\n",
    "[a](javascript:alert(1))": "<p>[a](javascript:alert(1))</p>\n",
    "[a](JaVaScRiPt:alert(1))": "<p>[a](JaVaScRiPt:alert(1))</p>\n",
    "[a](&#106;avascript:alert(1))": "<p>[a](javascript:alert(1))</p>\n",
    "[a](data:text/html;base64,x)": "<p>[a](data:text/html;base64,x)</p>\n",
    "[a](//elsewhere.example)": "<p>[a](//elsewhere.example)</p>\n",
    "<javascript:alert(1)>": "<p>&lt;javascript:alert(1)&gt;</p>\n",
    "![track](http://elsewhere.example/x.png)": "<p>!"
    '<a href="http://elsewhere.example/x.png" rel="noopener noreferrer nofollow" target="_blank">track</a></p>\n',
    '[a](http://b.example "t\\" onclick=\\"x")': '<p><a href="http://b.example" title="t&quot; onclick=&quot;x" '
    'rel="noopener noreferrer nofollow" target="_blank">a</a></p>\n',
    "[here](#/experiments/abc)": '<p><a href="#/experiments/abc">here</a></p>\n',
}


def test_notes_are_rendered_without_anything_that_runs_or_loads() -> None:
    assert {notes: render(notes) for notes in HARMLESS} == HARMLESS


def test_notes_are_served_as_html(api: TestClient) -> None:
    made = api.post("/studies", json=STUDY).json()
    api.patch(f"/studies/{made['id']}", json={"notes": "# Wet\n\n- *slippery*"}, headers={"If-Match": "*"})

    assert api.get(f"/studies/{made['id']}/notes").json()["html"].startswith("<h1>Wet</h1>\n<ul>")
    assert api.get(f"/studies/{made['experiments'][0]['id']}/notes").status_code == 409
