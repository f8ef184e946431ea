"""`gaplab events`, `gaplab accept-versions`, and what `gaplab show` says of provenance, on a service in a thread."""

import re

from gaplab.api.commands.exit_codes import Exit
from gaplab.services.running import execution
from gaplab.services.running.versions import provenance
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import run, some_log, submit_one, toy


def test_events_are_printed_a_line_each(sqlite_store: Store, gaplab: Gaplab) -> None:
    id_ = submit_one(sqlite_store, toy(repetitions=1)).id
    submit_one(sqlite_store, toy())
    run(sqlite_store, execution.claim(sqlite_store, "me", 1)[0])

    code, out, _ = gaplab("events", id_)
    _, probed, _ = gaplab("events", "--kind", "probed", "--after", "9")
    _, everything, _ = gaplab("events")

    assert code == 0
    assert out.splitlines()[-1].endswith(f"{id_} Completed")
    at = rf"\d{{4}}-\d\d-\d\d \d\d:\d\d:\d\d {id_}"
    assert re.search(rf"^ +\d+ {at} Repetition 0, iteration 2: measured in reality, 0.333$", out, re.M)
    assert len(out.splitlines()) == 18
    assert len(probed.splitlines()) == 2
    assert len(everything.splitlines()) == 19


def test_a_refusal_is_shown_and_can_be_lifted(sqlite_store: Store, gaplab: Gaplab) -> None:
    id_ = submit_one(sqlite_store, toy(repetitions=1)).id
    (claim,) = execution.claim(sqlite_store, "me", 1)
    execution.record(sqlite_store, claim, next(some_log()))
    execution.hand_back(sqlite_store, claim)
    execution.claim(sqlite_store, "other", 1, provenance().model_copy(update={"architecture": "riscv64"}))

    _, shown, warned = gaplab("show", id_)
    code, accepted, _ = gaplab("accept-versions", id_)
    _, _, silent = gaplab("show", id_)
    refused, _, why = gaplab("accept-versions", id_)

    assert f"computed with gaplab {provenance().gaplab}" in shown
    assert f"`gaplab accept-versions {id_}`" in warned
    assert (code, accepted) == (0, f"{id_} continues under the versions of the next supervisor.\n")
    assert silent == ""
    assert refused == Exit.CONFLICT
    assert "has not started" in why
