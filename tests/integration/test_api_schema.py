"""Schemathesis reads the OpenAPI document and asks everything that it permits, and what it does not.

All of its checks hold but one: that whatever fits the document is accepted. A document cannot say that a strategy must
be one of the catalogue, or a cursor one that was given out; such requests are refused with 422.
"""

from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from hypothesis.errors import Unsatisfiable
from hypothesis.stateful import run_state_machine_as_test
from schemathesis import Case, GenerationMode, Response
from schemathesis.schemas import BaseSchema

from api.app import create_app
from migrations import upgrade
from services.store.session import Store

QUICK = settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
FOLLOWING = settings(
    max_examples=15, stateful_step_count=6, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)


@pytest.fixture(scope="module", params=["sqlite", "postgres"])
def document(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[BaseSchema]:
    """The service over either database, as its own document describes it."""
    if request.param == "sqlite":
        url = f"sqlite:///{tmp_path_factory.mktemp('schema') / 'gaplab.db'}"
    else:
        server = request.getfixturevalue("postgres")
        server.create("schema")
        url = server.url("schema")
    upgrade(url)
    store = Store(url)
    found = schemathesis.openapi.from_asgi("/openapi.json", create_app(store))
    found.config.checks.update(excluded_check_names=["positive_data_acceptance"])
    yield found
    store.dispose()


@pytest.mark.parametrize("mode", list(GenerationMode), ids=lambda mode: mode.name.lower())
def test_every_request_that_the_document_permits_or_forbids_is_answered_as_it_says(
    document: BaseSchema, mode: GenerationMode
):
    asked = 0

    for found in document.get_all_operations():
        operation = found.ok()

        @QUICK
        @given(case=operation.as_strategy(generation_mode=mode))
        def ask(case: Case) -> None:
            nonlocal asked
            asked += 1
            case.call_and_validate()

        try:
            ask()
        except Unsatisfiable:  # nothing of this kind can be asked there: it takes no parameters
            assert mode is GenerationMode.NEGATIVE, operation.label

    assert asked > 100


def test_whatever_follows_from_what_is_answered_as_the_document_says(document: BaseSchema):
    class Following(document.as_state_machine()):  # type: ignore[misc]
        """Goes from an answer to what it links to."""

        def validate_response(self, response: Response, case: Case, **options: Any) -> None:
            followed.add(case.operation.label)
            super().validate_response(response, case, **options)

    followed: set[str] = set()
    run_state_machine_as_test(Following, settings=FOLLOWING)

    assert {"POST /experiments", "GET /experiments/{id}", "POST /experiments/{id}/cancel"} <= followed
