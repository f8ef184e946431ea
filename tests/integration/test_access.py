"""Tokens and roles: who is let in, to what, and what is never told."""

import logging
import re
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select, update

from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceError
from gaplab.schemas.access import Role
from gaplab.services import access
from gaplab.services.access import Unauthenticated, authenticate, create_token, is_loopback
from gaplab.services.core.errors import Forbidden, NotFound
from gaplab.services.settings import Settings
from gaplab.services.store.engine import PATIENCE_S, WRITES, open_engine
from gaplab.services.store.models import TokenRow
from gaplab.services.store.session import Store
from tests.commands import Gaplab

TOY = {"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke", "iterations": 1, "repetitions": 1}


@pytest.fixture
def api(sqlite_store: Store) -> Iterator[TestClient]:
    with TestClient(create_app(sqlite_store), raise_server_exceptions=False) as client:
        yield client


def bearer(store: Store, role: Role) -> dict[str, str]:
    return {"Authorization": f"Bearer {create_token(store, role).secret}"}


def test_on_loopback_all_is_open_until_a_token_is_made_and_stays_closed_after_the_last_is_revoked(
    sqlite_store: Store, api: TestClient
) -> None:
    before = api.post("/experiments", json=TOY).status_code
    made = create_token(sqlite_store, Role.READER)
    refused = api.get("/studies")
    let_in = api.get("/studies", headers={"Authorization": f"Bearer {made.secret}"}).status_code
    access.revoke_token(sqlite_store, made.token.id)
    revoked = api.get("/studies", headers={"Authorization": f"Bearer {made.secret}"})

    assert (before, refused.status_code, let_in, revoked.status_code) == (202, 401, 200, 401)
    assert refused.headers["www-authenticate"] == 'Bearer realm="gaplab"'
    assert refused.headers["content-type"] == revoked.headers["content-type"] == "application/problem+json"
    assert 'error="invalid_token"' in revoked.headers["www-authenticate"]
    assert api.get("/studies").status_code == 401


def test_beyond_loopback_a_token_is_needed_even_where_none_was_ever_made(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store, Settings(host="0.0.0.0")))

    assert api.get("/studies").status_code == 401
    assert [api.get(path).status_code for path in ("/livez", "/readyz")] == [200, 200]


@pytest.mark.parametrize(
    ("role", "permitted"),
    [
        (Role.READER, {"read", "estimate"}),
        (Role.RUNNER, {"read", "estimate", "submit", "check", "edit", "cancel"}),
        (Role.ADMIN, {"read", "estimate", "submit", "check", "edit", "cancel", "reveal"}),
    ],
)
def test_each_role_may_do_what_it_is_for_and_no_more(
    sqlite_store: Store, api: TestClient, role: Role, permitted: set[str]
) -> None:
    made = api.post("/experiments", json=TOY).json()["id"]
    headers = bearer(sqlite_store, role)
    answers = {
        "read": api.get(f"/experiments/{made}", headers=headers),
        "estimate": api.post("/studies/estimate", json={"robot": "toy_function"}, headers=headers),
        "submit": api.post("/experiments", json=TOY, headers=headers),
        "check": api.post("/sensitivity", json={"robot": "toy_function"}, headers=headers),
        "edit": api.patch(f"/studies/{made}", json={"name": "x"}, headers=headers | {"If-Match": "*"}),
        "reveal": api.get(f"/experiments/{made}?reveal=true", headers=headers),
        "cancel": api.post(f"/studies/{made}/cancel", headers=headers),
    }

    assert {name for name, answer in answers.items() if answer.is_success} == permitted
    for name in answers.keys() - permitted:
        assert answers[name].status_code == 403
        assert answers[name].json()["type"] == "urn:gaplab:problem:forbidden"
        assert "insufficient_scope" in answers[name].headers["www-authenticate"]


def test_every_route_wants_a_token_but_those_for_health_and_the_files_of_the_page(
    sqlite_store: Store, api: TestClient
) -> None:
    create_token(sqlite_store, Role.ADMIN)
    document = create_app(sqlite_store).openapi()
    routes = [(method, path) for path, operations in document["paths"].items() for method in operations]
    pages = [("get", path) for path in ("/", "/docs", "/redoc", "/openapi.json", "/assets/docs/swagger-ui.css", "/no")]

    found = {
        path: api.request(method, path.format(id="x", number=0, name="x", robot="x")).status_code
        for method, path in [*routes, *pages]
    }

    assert {path for path, status in found.items() if status != 401} == {
        "/livez",
        "/readyz",
        "/",
        "/assets/docs/swagger-ui.css",
    }


def test_what_is_no_token_lets_nobody_in_even_where_none_is_needed(api: TestClient) -> None:
    headers: list[Any] = [
        "Bearer",
        "Bearer ",
        "Bearer x",
        "Basic dXNlcjpwYXNz",
        "gaplab_abc_" + "0" * 64,
        "Bearer gaplab_abc_" + "0" * 64,
        "Bearer gaplab_" + "a" * 5000 + "_" + "0" * 64,
        "Bearer \u00e9".encode("latin-1"),
    ]

    found = {each: api.get("/studies", headers={"Authorization": each}).status_code for each in headers}

    assert found == dict.fromkeys(headers, 401)


def test_a_token_with_another_secret_lets_nobody_in(store: Store) -> None:
    made, other = (create_token(store, Role.ADMIN).secret for _ in range(2))
    forged = made.rpartition("_")[0] + "_" + other.rpartition("_")[2]

    with pytest.raises(Unauthenticated):
        authenticate(store, forged, required=True)
    assert authenticate(store, made, required=True).role is Role.ADMIN


def test_a_secret_is_stored_nowhere_and_a_use_is_noted(store: Store) -> None:
    made = create_token(store, Role.RUNNER, "ci")
    unused = access.list_tokens(store)[0]

    authenticate(store, made.secret, required=True)

    used = access.list_tokens(store)[0]
    assert (used.id, used.name, used.role, unused.last_used_at) == (made.token.id, "ci", Role.RUNNER, None)
    assert used.last_used_at is not None
    assert made.secret.rpartition("_")[2] not in repr(made) + used.model_dump_json()
    with store.reading() as session:
        from sqlalchemy import text

        rows = session.execute(text("SELECT * FROM token")).all()
    assert made.secret.rpartition("_")[2] not in str(rows)


@pytest.mark.dialects
def test_a_request_does_not_wait_until_its_use_can_be_noted(store: Store) -> None:
    made = create_token(store, Role.READER)

    with store.transaction() as session:
        session.execute(update(TokenRow).values(name="held"))
        began = time.monotonic()
        caller = authenticate(store, made.secret, required=True)
        waited_s = time.monotonic() - began
    held = access.list_tokens(store)[0]
    authenticate(store, made.secret, required=True)

    assert (caller.token, held.name, held.last_used_at) == (made.token.id, "held", None)
    assert waited_s < PATIENCE_S / 2
    assert access.list_tokens(store)[0].last_used_at is not None
    assert store.errors == 0


def test_a_request_does_not_wait_for_those_who_read_a_database(sqlite_store: Store) -> None:
    made = create_token(sqlite_store, Role.READER)

    with sqlite_store.reading() as session:
        session.execute(select(TokenRow)).all()
        began = time.monotonic()
        authenticate(sqlite_store, made.secret, required=True)
        waited_s = time.monotonic() - began

    assert waited_s < PATIENCE_S / 2


def test_others_wait_as_long_as_before_after_a_use_was_noted_at_once(sqlite_store: Store) -> None:
    made = create_token(sqlite_store, Role.READER)
    authenticate(sqlite_store, made.secret, required=True)

    with ThreadPoolExecutor(1) as pool:
        with sqlite_store.transaction() as session:
            session.execute(update(TokenRow).values(name="held"))
            second = pool.submit(create_token, sqlite_store, Role.READER)
            time.sleep(0.5)
        second.result()

    assert len(access.list_tokens(sqlite_store)) == 2


def test_secrets_have_256_bits_and_differ(sqlite_store: Store) -> None:
    secrets = {create_token(sqlite_store, Role.READER).secret.rpartition("_")[2] for _ in range(20)}

    assert len(secrets) == 20
    assert all(re.fullmatch("[0-9a-f]{64}", each) for each in secrets)


def test_an_unknown_token_cannot_be_revoked(store: Store) -> None:
    with pytest.raises(NotFound):
        access.revoke_token(store, "none\0such")


def test_no_token_is_in_logs_answers_or_problems_whatever_happens(
    sqlite_store: Store, api: TestClient, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    caplog.set_level(logging.DEBUG)
    headers = bearer(sqlite_store, Role.READER)
    secret = headers["Authorization"].rpartition("_")[2]
    said = [api.get("/studies", headers=headers), api.post("/experiments", json=TOY, headers=headers)]
    monkeypatch.setattr("gaplab.services.experiments.listing.list_studies", lambda *_, **__: 1 / 0)
    said.append(api.get("/studies", headers=headers))
    said.append(api.get("/studies", headers={"Authorization": f"Bearer gaplab_x_{secret}"}))

    assert [each.status_code for each in said] == [200, 403, 500, 401]
    assert secret not in caplog.text
    assert not any(secret in each.text + str(each.headers) for each in said)


def test_without_tokens_no_page_of_another_site_is_served(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store, Settings()), base_url="http://127.0.0.1:8000")
    strange = [
        {"host": "evil.example"},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"host": "["},
        {"origin": "http://["},
    ]

    refused = [api.get("/studies", headers=each).status_code for each in strange]
    refused += [api.post("/experiments", json=TOY, headers=each).status_code for each in strange]
    own = ({"origin": "http://127.0.0.1:8000"}, {"host": "localhost:8000"})
    served = [api.get("/studies", headers=each).status_code for each in own]
    token = bearer(sqlite_store, Role.READER)
    served += [api.get("/studies", headers=each | token).status_code for each in strange]

    assert refused == [403] * 10
    assert served == [200] * 7


def test_other_origins_are_told_nothing_by_cors(api: TestClient) -> None:
    plain = api.get("/studies", headers={"origin": "http://evil.example"})
    asked = api.options(
        "/experiments", headers={"origin": "http://evil.example", "access-control-request-method": "POST"}
    )

    assert asked.status_code == 405
    assert not [name for name in (*plain.headers, *asked.headers) if name.startswith("access-control")]


def test_loopback_is_what_only_this_machine_reaches() -> None:
    inside = ("127.0.0.1", "127.8.8.8", "::1", "localhost")
    outside = ("0.0.0.0", "::", "192.168.1.2", "localhost.evil.example", "")

    assert [host for host in (*inside, *outside) if is_loopback(host)] == list(inside)


def test_the_command_makes_lists_and_revokes_tokens_in_the_database_itself(
    sqlite_url: str, sqlite_store: Store, gaplab: Gaplab
) -> None:
    database = {"GAPLAB_DATABASE_URL": sqlite_url}
    _, secret, about = gaplab("token", "create", "--role", "runner", "--name", "night runs", **database)
    caller = authenticate(sqlite_store, secret.strip(), required=True)
    _, listed, _ = gaplab("token", "list", **database)
    code, _, _ = gaplab("token", "revoke", caller.token or "", **database)
    _, after, _ = gaplab("token", "list", **database)

    assert caller.role is Role.RUNNER
    assert "once" in about
    assert "night runs" in listed
    assert secret.strip() not in listed + about
    assert code == 0
    assert len(re.findall(r"\d{4}-\d\d-\d\d", listed)) == 2
    assert len(re.findall(r"\d{4}-\d\d-\d\d", after)) == 3
    with pytest.raises(Unauthenticated):
        authenticate(sqlite_store, secret.strip(), required=True)


def test_a_token_is_refused_where_it_would_migrate_a_database_that_a_service_may_use(
    sqlite_url: str, gaplab: Gaplab
) -> None:
    engine = open_engine(sqlite_url)
    with engine.execution_options(**{WRITES: True}).begin() as connection:
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '0000'")

    code, secret, said = gaplab("token", "create", "--role", "admin", GAPLAB_DATABASE_URL=sqlite_url)

    with engine.connect() as connection:
        found = connection.exec_driver_sql("SELECT version_num FROM alembic_version").scalars().all()
    engine.dispose()
    assert (code, secret, found) == (1, "", ["0000"])
    assert "at revision 0000" in said
    assert "run `python -m migrations`" in said


def test_a_first_token_can_be_made_before_the_database_was_ever_used(tmp_path: Path, gaplab: Gaplab) -> None:
    new = f"sqlite:///{tmp_path / 'new.db'}"

    code, secret, _ = gaplab("token", "create", "--role", "admin", GAPLAB_DATABASE_URL=new)

    assert code == 0
    assert secret.startswith("gaplab_")


def test_a_client_shows_the_token_that_it_is_given_or_that_of_the_environment(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    secret = create_token(sqlite_store, Role.READER).secret
    transport = TestClient(create_app(sqlite_store))._transport  # what carries requests into the app itself

    def items(token: str | None = None) -> tuple[Any, ...]:
        with Client("http://testserver", token=token, transport=transport) as client:
            return client.studies().items

    with pytest.raises(ServiceError, match="GAPLAB_TOKEN") as refused:
        items()
    assert refused.value.problem.status == 401
    assert items(secret) == ()
    monkeypatch.setenv("GAPLAB_TOKEN", secret)
    assert items() == ()


def test_only_an_admin_may_demand_what_an_admin_may() -> None:
    for role in (Role.READER, Role.RUNNER):
        with pytest.raises(Forbidden, match="an admin"):
            access.demand(access.Caller("x", role), Role.ADMIN, "this")
    access.demand(access.Caller("x", Role.ADMIN), Role.READER, "this")
