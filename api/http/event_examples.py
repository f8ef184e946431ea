"""Examples of events and provenance that `/docs` shows, built from their schemas."""

from datetime import UTC, datetime, timedelta

from gaplab.schemas.events import EventKind, EventPage, EventRead
from gaplab.schemas.provenance import Provenance, ProvenanceRead, ProvenanceUse

_CREATED = datetime(2012, 11, 5, 9, 0, tzinfo=UTC)
_ID = "01f2e3d4c5b6"

_EVENT = EventRead(
    number=412,
    kind=EventKind.PROBED,
    experiment=_ID,
    repetition=3,
    body={"iteration": 1, "fitness": 1.31, "recorded_fitness": 1.31},
    at=_CREATED + timedelta(seconds=40),
)

EVENTS = EventPage(items=(_EVENT,), last=412, latest=412)

STREAM = f"event: {_EVENT.kind}\ndata: {_EVENT.model_dump_json()}\nid: {_EVENT.number}\n\n"

PROVENANCE = ProvenanceRead(
    computed_with="pybullet (pybullet 3.2.7), x86_64, spec 1",
    uses=(
        ProvenanceUse(
            id="5f1d8a7b0c3e2946",
            since=_CREATED + timedelta(seconds=1),
            repetitions=40,
            provenance=Provenance(
                gaplab="0.1.0",
                code="a1b2c3d4",
                commit="3b875b0d5f0e4c1a9b7e6d2f8a0c4b6e1d3f5a79",
                dirty=False,
                python="3.11.14",
                libraries={"numpy": "2.4.6", "scipy": "1.17.1"},
                engines={"pybullet": "pybullet 3.2.7"},
                architecture="x86_64",
                processor="AMD EPYC 9555",
                system="Linux-6.8.0-x86_64-with-glibc2.36",
                spec_version=1,
            ),
        ),
    ),
)
