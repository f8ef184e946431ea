"""Schemathesis reads the OpenAPI document and asks everything that it permits, and what it does not.

It takes the examples, the edges of every schema, random requests of both kinds, and follows the links of answers. All
of its checks hold but one: that whatever fits the document is accepted. A document cannot say that a strategy must be
one of the catalogue, or a cursor one that was given out; such requests are refused with 422.
"""

from collections import Counter

import pytest
import schemathesis
from schemathesis.engine import from_schema
from schemathesis.engine.events import EngineFinished, FatalError, NonFatalError, ScenarioFinished
from schemathesis.schemas import BaseSchema

from gaplab.api.app import create_app
from gaplab.services.store.session import Store


@schemathesis.serializer("application/zip")
def archive(_: object, value: object) -> bytes:
    """What is made up is hardly ever a zip; it is refused as whatever else is none."""
    return value if isinstance(value, bytes) else str(value).encode(errors="replace")


@pytest.fixture
def document(store: Store, pytestconfig: pytest.Config) -> BaseSchema:
    """The service, as its own document describes it; before a release, more of what it permits and forbids."""
    thorough = pytestconfig.getoption("all")
    examples, walks = (5, 30) if thorough else (1, 15)
    found = schemathesis.openapi.from_asgi("/openapi.json", create_app(store)).exclude(path="/events")  # it never ends
    found.config.parameters = {"wait_s": 0}
    found.config.checks.update(excluded_check_names=["positive_data_acceptance"])
    found.config.generation.update(max_examples=examples, deterministic=True)
    found.config.phases.stateful.generation.update(max_examples=walks, deterministic=True)
    found.config.phases.coverage.enabled = thorough
    return found


def test_whatever_is_asked_and_whatever_follows_is_answered_as_the_document_says(document: BaseSchema) -> None:
    asked: Counter[str] = Counter()
    followed: set[str] = set()
    troubles = []
    for event in from_schema(document).execute():
        if isinstance(event, ScenarioFinished):
            labels = [case.value.operation.label for case in event.recorder.cases.values()]
            asked[event.phase.value] += len(labels)
            followed |= set(labels) if event.phase.value.lower().startswith("stateful") else set()
        if isinstance(event, NonFatalError | FatalError):
            troubles.append(str(getattr(event, "value", None) or getattr(event, "exception", event)))
        if isinstance(event, EngineFinished):
            failures = [f"{each.title}: {each.message}" for each in event.failures]

    assert troubles == []
    assert failures == []
    assert asked.total() > 150, asked
    assert {"POST /experiments", "POST /studies"} & followed
    assert len([each for each in followed if "{id}" in each]) >= 3, followed
