"""What browsers are told: to run what a page brings, and nothing else."""

import re
from base64 import b64encode
from hashlib import sha256
from typing import Any

from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.services.store.session import Store

TOY = {"strategy": "random", "robot": "toy_function", "budget": "smoke"}


def policy_of(answer: object) -> dict[str, set[str]]:
    parts = (part.split() for part in answer.headers["content-security-policy"].split(";"))  # type: ignore[attr-defined]
    return {name: set(sources) for name, *sources in parts}


def test_every_answer_says_what_a_browser_may_do_with_it(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store))
    study = api.post("/studies", json={"robot": "toy_function", "budget": "smoke"}).json()["id"]
    figure = f"/figures/curves?study={study}"

    for path in ("/docs", "/redoc", figure, f"{figure}&format=svg", f"/studies/{study}", "/no", "/livez"):
        permits_only_its_own_scripts(api.get(path), path)


def permits_only_its_own_scripts(answer: Any, path: str) -> None:
    headers, found = answer.headers, policy_of(answer)
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert found["frame-ancestors"] == found["default-src"] == {"'none'"}
    assert "'unsafe-inline'" not in found.get("script-src", set())
    if "html" in headers["content-type"]:
        scripts = re.findall(r"<script(?![^>]*\bsrc=)[^>]*>(.*?)</script>", answer.text, re.DOTALL)
        hashes = {f"'sha256-{b64encode(sha256(each.encode()).digest()).decode()}'" for each in scripts}
        assert hashes or path == "/redoc"
        assert found["script-src"] == {"'self'"} | hashes
    else:
        assert "script-src" not in found


def test_a_script_that_someone_slipped_in_as_a_name_is_no_script_of_the_page(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store))
    bad = "<script>alert(1)</script>"
    made = api.post("/experiments", json=TOY | {"name": bad}).json()["id"]

    answer = api.get("/figures/curves", params={"study": made, "title": bad})

    assert answer.status_code == 200
    assert bad not in answer.text
    assert b64encode(sha256(b"alert(1)").digest()).decode() not in answer.headers["content-security-policy"]
