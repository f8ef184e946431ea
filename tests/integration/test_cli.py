"""The command, against a service in a thread: what it prints, and how it ends."""

import json
import re
import threading
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceUnreachable
from gaplab.api.commands import demo
from gaplab.api.commands.exit_codes import Exit
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.findings.sensitivity import Effort, check
from gaplab.services.running import execution, sensitivity
from gaplab.services.specs.assembly import subject
from gaplab.services.store.lease import Failure
from gaplab.services.store.session import Store
from tests.commands import Gaplab, served
from tests.experiments import finish, listed
from tests.waiting import wait_until

EXAMPLES = Path(__file__).parents[2] / "examples"
SMOKE = str(EXAMPLES / "smoke.json")


def wait_for_submission(store: Store) -> None:
    """Wait until an experiment is queued, and its watcher has printed a line."""
    wait_until(lambda: listed(store))
    time.sleep(0.5)


def submitted(gaplab: Gaplab, spec: str = SMOKE) -> str:
    return gaplab("submit", spec).out.strip()


def test_submit_prints_the_id_that_show_and_list_know(gaplab: Gaplab) -> None:
    id = submitted(gaplab)

    shown, listed, whole = gaplab("show", id), gaplab("list"), gaplab("show", id, "--spec")

    assert (shown.code, listed.code) == (0, 0)
    assert id in shown.out
    assert "QUEUED" in shown.out
    assert '"preset": "smoke"' not in shown.out
    assert '"preset": "smoke"' in whole.out
    assert id in listed.out


def test_an_edit_that_is_none_is_a_sentence(gaplab: Gaplab) -> None:
    id = submitted(gaplab)

    nothing, nameless = gaplab("edit", id), gaplab("edit", id, "--name", "")

    assert (nothing.code, nameless.code) == (Exit.INVALID, Exit.INVALID)
    assert nothing.err == "gaplab: nothing to change: give --name or --notes; `gaplab tag` changes tags\n"
    assert nameless.err == "gaplab: --name must have at least 1 character, not 0\n"


def test_a_spec_with_several_strategies_or_none_is_a_study(gaplab: Gaplab) -> None:
    submitted(gaplab, str(EXAMPLES / "toy.json"))
    submitted(gaplab, str(EXAMPLES / "weights.json"))

    listed = gaplab("list").out

    assert "toy function (7)" in listed
    assert "information? (5)" in listed


def test_a_spec_comes_from_standard_input_too(gaplab: Gaplab) -> None:
    said = gaplab("submit", "-", stdin='{"strategy": "random", "budget": "smoke"}')

    assert said.code == 0
    assert "random" in gaplab("list").out


def test_watching_shows_progress_line_by_line_where_there_is_no_terminal(gaplab: Gaplab, sqlite_store: Store) -> None:
    def work() -> None:
        wait_for_submission(sqlite_store)
        finish(sqlite_store)

    worker = threading.Thread(target=work)
    worker.start()
    said = gaplab("submit", SMOKE, "--watch")
    worker.join()

    assert said.code == 0
    assert re.search(r"smoke: 0 %, 0 of 2 repetitions", said.out)
    assert said.out.splitlines()[-1].startswith("smoke: COMPLETED; 2 of 2 repetitions")
    assert "\x1b" not in said.out


def test_watching_what_fails_says_why_and_ends_with_1(gaplab: Gaplab, sqlite_store: Store) -> None:
    def work() -> None:
        wait_for_submission(sqlite_store)
        for claim in execution.claim(sqlite_store, "test", limit=10):
            execution.fail(sqlite_store, claim, Failure("ValueError: the robot fell apart"))

    worker = threading.Thread(target=work)
    worker.start()
    said = gaplab("submit", SMOKE, "--watch")
    worker.join()

    assert said.code == Exit.FAILED
    assert "FAILED" in said.out
    assert "the robot fell apart" in said.err


def test_a_demo_whose_study_failed_says_why_and_ends_with_1(
    gaplab: Gaplab, sqlite_store: Store, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    id = submitted(gaplab)
    for claim in execution.claim(sqlite_store, "test", limit=10):
        execution.fail(sqlite_store, claim, Failure("ValueError: the robot fell apart"))

    def wait(*_: object) -> None:
        with Client(url) as client:
            client.wait(id, progress=False)

    monkeypatch.setattr(demo, "run", wait)
    said = gaplab("demo")

    assert (said.code, said.err) == (
        Exit.FAILED,
        f"gaplab: smoke ({id}) ended as FAILED; ValueError: the robot fell apart\n",
    )


def test_curves_are_a_table_values_or_drawings(gaplab: Gaplab, sqlite_store: Store, tmp_path: Path) -> None:
    small = {"strategies": ["random", "direct"], "robot": "toy_function", "budget": "smoke", "repetitions": 3}
    id = gaplab("submit", "-", stdin=json.dumps(small)).out.strip()
    finish(sqlite_store)
    svg, html = tmp_path / "new" / "fig.svg", tmp_path / "fig.html"

    table, values = gaplab("curve", id), gaplab("curve", id, "--csv")
    drawn = gaplab("figure", "curves", id, "-o", str(svg), "-o", str(html))

    assert re.search(r"^ *2 +\d+\.\d\d±\d+\.\d\d", table.out, re.MULTILINE)
    assert "evolved in reality itself" in table.out
    assert values.out.startswith("experiment,name,strategy,repetition,evaluations,fitness\n")
    assert drawn.code == 0
    assert ET.fromstring(svg.read_text()).tag.endswith("svg")
    assert html.read_text().startswith("<!doctype html>")


def test_a_cancelled_study_has_no_experiment_left_to_run(gaplab: Gaplab) -> None:
    id = submitted(gaplab, str(EXAMPLES / "toy.json"))

    first, second = gaplab("cancel", id), gaplab("cancel", id)

    assert first.code == 0
    assert gaplab("show", id).out.count("CANCELLED") == 8
    assert second.code == Exit.CONFLICT


def test_the_verbs_say_what_it_is_now_and_forbidden_ones_are_a_sentence(gaplab: Gaplab, sqlite_store: Store) -> None:
    id = submitted(gaplab)

    said = [gaplab(verb, id) for verb in ("pause", "resume", "resume")]
    finish(sqlite_store)
    said += [gaplab("extend", id, "--iterations", "4"), gaplab("extend", id, "--repetitions", "3")]

    assert [each.out.rpartition(" is ")[2].strip() for each in said] == ["PAUSED.", "QUEUED.", "", "QUEUED.", ""]
    assert [each.code for each in said] == [0, 0, Exit.CONFLICT, 0, Exit.CONFLICT]
    assert said[2].err.endswith("is QUEUED and cannot be resumed; permitted: pause, stop, cancel\n")
    assert gaplab("stop", id).out.endswith("is COMPLETED, stopped early, 35 % done.\n")


def test_the_catalogue_lists_every_kind_of_plug_in(gaplab: Gaplab) -> None:
    said = gaplab("catalogue").out

    assert all(
        name in said for name in ("simulated_fit_and_unique", "quadruped", "pybullet", "restitution", "steady_state")
    )


def checked(store: Store) -> None:
    """Run the check that is queued, as soon as one is."""
    claim = wait_until(lambda: sensitivity.claim(store, "test"))
    sensitivity.complete(store, claim, check(subject(claim.spec), SteadyState(), Effort(17, 100)))


DULL = {
    "name": "dull",
    "strategies": ["random"],
    "robot": "toy_function",
    "budget": "smoke",
    "tunables": ["static_friction", {"name": "restitution", "lower": 0.3, "upper": 0.3001}],
}


def test_sensitivity_waits_for_a_table_and_warns(gaplab: Gaplab, sqlite_store: Store) -> None:
    worker = threading.Thread(target=checked, args=(sqlite_store,))
    worker.start()
    said = gaplab("sensitivity", "-", stdin=json.dumps(DULL))
    worker.join()

    assert said.code == 0
    assert re.search(r"^ *Static friction +0 to 1.5 .* smooth *$", said.out, re.MULTILINE)
    assert re.search(r"^ *Restitution +0.3 to 0.3001 .* nothing *$", said.out, re.MULTILINE)
    assert "restitution over 0.3 to 0.3001 does nothing" in said.out


def test_a_sensitivity_check_that_failed_is_a_sentence(gaplab: Gaplab, sqlite_store: Store) -> None:
    def fail() -> None:
        claim = wait_until(lambda: sensitivity.claim(sqlite_store, "test"))
        sensitivity.fail(sqlite_store, claim, "ValueError: no legs")

    worker = threading.Thread(target=fail)
    worker.start()
    said = gaplab("sensitivity", SMOKE)
    worker.join()

    assert said.code == Exit.FAILED
    assert re.fullmatch(r"gaplab: the check \w+ ended as FAILED: ValueError: no legs\n", said.err)


def test_mistakes_in_what_is_to_be_checked_are_sentences(gaplab: Gaplab) -> None:
    said = gaplab("sensitivity", "-", stdin='{"robot": "quadruppet", "points": 1}')

    assert said.code == Exit.INVALID
    assert said.err.startswith("gaplab: /points: ")


def test_show_tells_warnings_and_misfit(gaplab: Gaplab, sqlite_store: Store) -> None:
    small = {"strategy": "random", "robot": "toy_function", "budget": "smoke", "repetitions": 3}
    tunables = ["static_friction", {"name": "restitution", "lower": 0.3, "upper": 0.3001}]
    id = gaplab("submit", "-", stdin=json.dumps(small | {"tunables": tunables})).out.strip()
    checked(sqlite_store)
    before = gaplab("show", id)
    finish(sqlite_store)

    after = gaplab("show", id)

    assert "warning: restitution over 0.3 to 0.3001 does nothing" in before.err
    assert "the best simulators err by" not in before.out
    assert "at 2 real-world evaluations the best simulators err by" in after.out
    assert re.search(r"^ *Static friction +0.1 ± 0 ", after.out, re.MULTILINE)


def test_no_service_is_a_sentence_that_says_how_to_start_one(gaplab: Gaplab) -> None:
    said = gaplab("list", "--url", "http://127.0.0.1:9")

    assert said.code == Exit.UNREACHABLE
    assert said.err.startswith("gaplab: no service answers at http://127.0.0.1:9")
    assert "gaplab serve" in said.err


def test_an_address_that_is_none_is_a_sentence(gaplab: Gaplab) -> None:
    for address in ("nonsense", "http://[", "ftp://127.0.0.1", "http://no-such-host.invalid", ""):
        said = gaplab("list", GAPLAB_URL=address)

        assert (said.code, said.err.count("\n")) == (Exit.UNREACHABLE, 1), address


def test_an_id_that_is_unknown_or_can_be_none_is_a_sentence(gaplab: Gaplab) -> None:
    names = ("nope", "..", "", " ", "a/b", "x?y", "%", "ü", "\udcff")
    for command in (*(("show", name) for name in names), ("curve", "a/b"), ("cancel", "..")):
        said = gaplab(*command)

        assert said.code == Exit.NOT_FOUND, command
        assert re.fullmatch(r"gaplab: there is no.*\n", said.err), command


def test_every_mistake_in_a_spec_has_a_line_of_its_own(gaplab: Gaplab) -> None:
    said = gaplab("submit", "-", stdin='{"strategy": "simulated_fti", "robot": "quadruppet"}')

    assert said.code == Exit.INVALID
    assert sorted(line.split(": ")[1] for line in said.err.splitlines()) == ["/robot", "/strategy"]
    assert "did you mean 'simulated_fit'?" in said.err


def test_a_file_that_is_no_spec_or_cannot_be_read_is_a_sentence(gaplab: Gaplab, tmp_path: Path) -> None:
    file = tmp_path / "spec.json"
    for text in ("", "{", "[1]", '{"seed": NaN}', "[" * 100_000, '"text"'):
        file.write_text(text)
        said = gaplab("submit", str(file))

        assert (said.code, said.err.count("\n")) == (Exit.FILE, 1), text[:20]
        assert said.err.startswith(f"gaplab: {file}")
    for name in ("missing.json", ".", "\udcff.json"):
        said = gaplab("submit", name)

        assert (said.code, said.err.count("\n")) == (Exit.FILE, 1), name


def test_a_file_that_is_there_already_is_a_sentence(gaplab: Gaplab, sqlite_url: str, tmp_path: Path) -> None:
    file = tmp_path / "there.db"
    file.touch()

    said = gaplab("backup", str(file), GAPLAB_DATABASE_URL=sqlite_url)

    assert (said.code, said.err) == (Exit.FILE, f"gaplab: {file}: a file of this name is there already\n")


def test_a_token_that_cannot_be_one_is_said_at_once(gaplab: Gaplab) -> None:
    for token in ("a\nb", "é", "\udcff"):
        assert "the token has characters" in gaplab("list", GAPLAB_TOKEN=token).err


def test_a_token_that_is_none_is_an_id_that_is_none(gaplab: Gaplab, sqlite_url: str) -> None:
    assert gaplab("token", "revoke", "nobody", GAPLAB_DATABASE_URL=sqlite_url).code == Exit.NOT_FOUND


def test_wrong_use_of_the_command_ends_with_2_and_help_tells_the_codes(gaplab: Gaplab) -> None:
    assert gaplab("submit").code == Exit.USAGE
    assert gaplab("list", "--limit", "0").code == Exit.USAGE
    assert "Exit codes" in gaplab("--help").out


def test_a_wrong_argument_is_named_with_what_is_permitted(gaplab: Gaplab) -> None:
    wrong = {
        ("list", "--limit", "-1"): 'it must be at least 1, not "-1"',
        ("list", "--limit", "abc"): 'it must be a whole number, not "abc"',
        ("watch", "e1", "--every", "abc"): 'it must be a finite number, not "abc"',
        ("compare", "e1", "--format", "xml"): "'--format': 'xml' is not one of 'table',",
        ("views", "save", "mine", "--sort", "xml"): "'--sort': 'xml' is not one of",
    }

    for arguments, message in wrong.items():
        said = gaplab(*arguments)
        assert (said.code, message in said.err) == (Exit.USAGE, True), arguments


def test_a_port_that_is_no_number_in_the_environment_is_a_sentence(gaplab: Gaplab) -> None:
    said = gaplab("list", GAPLAB_PORT="eighty")

    assert said.code == Exit.FAILED
    assert "GAPLAB_PORT is 'eighty'" in said.err


def test_every_example_is_accepted_and_says_its_name(gaplab: Gaplab) -> None:
    for example in EXAMPLES.glob("*.json"):
        said = gaplab("submit", str(example), "--yes")

        assert said.code == 0, said.err
        assert json.loads(example.read_text())["name"]


def test_the_client_knows_when_what_answers_is_no_gaplab() -> None:
    async def other(scope: dict[str, Any], receive: object, send: Callable[..., Any]) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"<html>hello</html>"})

    with served(other) as address, Client(address) as client, pytest.raises(ServiceUnreachable, match="not gaplab"):
        client.studies()


def test_an_option_without_an_effect_is_refused_with_what_to_do(gaplab: Gaplab, tmp_path: Path) -> None:
    study = json.loads(gaplab("submit", str(EXAMPLES / "toy.json"), "--json").out)["id"]
    refused = {
        ("show", study, "--spec"): f"`gaplab spec {study} --resolved`",
        ("curve", study, "--csv", "--json"): "only one of --csv and --json",
        ("rerun", str(tmp_path / "x.zip"), "--repetitions", "1"): "add --verify",
    }
    for command, why in refused.items():
        told = gaplab(*command)
        assert told.code == Exit.USAGE
        assert why in " ".join(told.err.replace("│", " ").split())
