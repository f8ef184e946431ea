"""Every command, found by introspection: a JSON document of each that prints something; help, completion, watching."""

import io
import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
import typer
from rich.console import Console

from gaplab.api.clients import drivers
from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable
from gaplab.api.clients.progress import Snapshot, show, spark
from gaplab.api.commands import completion
from gaplab.api.commands.cli import app
from gaplab.api.commands.exit_codes import BY_STATUS, Exit
from gaplab.api.http import problems
from gaplab.services.running import execution
from gaplab.services.store.lease import Failure
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.integration.test_bench import compute
from tests.robot_texts import MJCF

STUDY = {
    "name": "all [of] it",
    "strategies": ["random", "direct"],
    "robot": "toy_function",
    "budget": "smoke",
    "repetitions": 3,
    "tunables": ["static_friction", "dynamic_friction"],
}
UNTIL_STOPPED = {"serve", "demo", "drive"}
"""They run until they are stopped or for minutes, and what they print is their log."""


def commands(of: Any = None, name: str = "") -> Iterator[tuple[str, Any]]:
    """Every command that runs by itself, with its name: those of groups, and groups like `views`."""
    command: Any = of or typer.main.get_command(app)
    parts = getattr(command, "commands", {})
    if not parts or command.invoke_without_command:
        yield name, command
    for part, each in parts.items():
        yield from commands(each, f"{name} {part}".strip())


NAMES = [name for name, _ in commands()]


@pytest.fixture
def study(gaplab: Gaplab) -> str:
    return gaplab("submit", "-", stdin=json.dumps(STUDY)).out.strip()


def test_every_command_that_prints_something_has_the_option() -> None:
    lacking = {name for name, command in commands() if "--json" not in {o for p in command.params for o in p.opts}}

    assert lacking == UNTIL_STOPPED
    assert len(NAMES) > 20


@pytest.fixture
def said() -> dict[str, Any]:
    """The document of each command that was asked."""
    return {}


@pytest.fixture
def ask(gaplab: Gaplab, said: dict[str, Any], plug_ins: Callable[..., None]) -> Callable[..., Any]:
    """Gives the document that a command prints; the plug-ins are as before at the end."""

    def document(name: str, *arguments: str, **shell: str) -> Any:
        answer = gaplab(*name.split(), *arguments, "--json", **shell)
        assert answer.code == 0, (name, answer)
        said[name] = json.loads(answer.out)
        return said[name]

    return document


@pytest.mark.release
def test_every_command_prints_one_document_and_nothing_else(
    ask: Callable[..., Any],
    said: dict[str, Any],
    sqlite_url: str,
    sqlite_store: Store,
    finish: Callable[[], None],
    tmp_path: Path,
) -> None:
    live_and_die(ask, finish)
    look(ask, *(each["id"] for each in said["list"][::-1]))
    keep(ask, said["list"][-1]["id"], tmp_path)
    tidy(ask, said["list"][-1]["id"])
    measure_on_a_bench(ask, sqlite_store, tmp_path)
    bring_a_robot(ask, tmp_path)
    compute_here(ask, tmp_path)
    database = {"GAPLAB_DATABASE_URL": sqlite_url}
    assert ask("backup", str(tmp_path / "copy.db"), **database)["bytes"] > 0
    restored = ask("restore", str(tmp_path / "copy.db"), GAPLAB_DATABASE_URL=f"sqlite:///{tmp_path / 'restored.db'}")
    assert restored["file"] == str(tmp_path / "restored.db")
    token = ask("token create", "--role", "reader", "--name", "me", **database)
    assert token["token"]["id"] in {each["id"] for each in ask("token list", **database)}
    assert ask("token revoke", token["token"]["id"], **database) == {"id": token["token"]["id"], "revoked": True}
    assert set(ask("help")) == {str(each.value) for each in Exit}

    # want a body, a worker, an experiment under way, a failed one, recordings, and a request that is stuck
    elsewhere = {"simulator", "replay", "sensitivity", "accept-versions", "retry", "traces", "reopen", "try-tunables"}
    assert set(said) | elsewhere == set(NAMES) - UNTIL_STOPPED


def compute_here(ask: Callable[..., Any], folder: Path) -> None:
    toy = {"strategy": "random", "robot": "toy_function", "budget": "smoke", "repetitions": 1}
    assert ask("run", "-", stdin=json.dumps(toy))["state"] == "COMPLETED"
    (folder / "runs.csv").write_text("gene_0,value\n0.3,0.4\n0.5,0.2\n0.7,0.6\n")
    found = ask("tune", "toy_function", str(folder / "runs.csv"), "--tunables", "static_friction", "--held-out", "0")
    assert "static_friction" in json.dumps(found)
    once = ("--tunables", "motor_gain", "--draws", "1", "--samples", "1", "--engine", "mujoco")
    assert [each["name"] for each in ask("recover", "quadruped", *once)["tunables"]] == ["motor_gain"]


def bring_a_robot(ask: Callable[..., Any], folder: Path) -> None:
    (folder / "m.xml").write_text(MJCF.format(""))
    imported = ask("robot import", str(folder / "m.xml"), "-o", str(folder / "m.json"))
    assert ask("robot add", imported["file"])["sha256"] == imported["sha256"]
    assert [each["name"] for each in ask("robot list")] == ["m"]
    table = folder / "log.csv"
    table.write_text("recording,time_s,position_ja,position_jb\none,0,0,0\none,1,0,0\ntwo,0,0,0\ntwo,1,0,0\n")
    found = ask("pool import", str(table), "--robot", imported["file"], "--name", "log", "-o", str(folder / "log.json"))
    assert ask("pool add", found["file"])["sha256"] == found["sha256"]
    assert [each["recordings"] for each in ask("pool list")] == [2]


def measure_on_a_bench(ask: Callable[..., Any], store: Store, folder: Path) -> None:
    spec = {"strategy": "random", "robot": "quadruped", "budget": "smoke", "repetitions": 1, "iterations": 1}
    id = ask("submit", "-", stdin=json.dumps(spec | {"reality": {"kind": "physical", "probes": "never"}}))["id"]
    compute(store)
    (request,) = ask("requests", id)
    assert ask("motion", request["id"])["times_s"]
    assert ask("measured", request["id"], "0.3")["state"] == "counted"
    other = ask("measured", request["id"], "0.4")["id"]
    assert ask("decide", other, "this", "--reason", "the first was another")["request"] == request["id"]
    answer = ask("correct", other, "0.5", "--reason", "a slip")["answer"]
    compute(store)
    assert ask("takehome", id, str(folder / "home.zip"))["bytes"] > 0
    assert ask("void", answer, "--reason", "the floor was wet")["iteration"] == 1


def tidy(ask: Callable[..., Any], ended: str) -> None:
    assert ask("tag", ended, "gait")["tags"] == ["gait"]
    assert ask("notify", ended) == {"host": None}
    assert ask("archive", ended)["archived_at"]
    assert ask("unarchive", ended)["archived_at"] is None
    assert ask("views save", "mine", "--query", "tag = gait")["name"] == "mine"
    assert [view["name"] for view in ask("views")] == ["mine"]
    assert ask("views delete", "mine")["query"] == "tag = gait"
    assert ask("delete", ended, "--yes")["id"] == ended


def live_and_die(ask: Callable[..., Any], finish: Callable[[], None]) -> None:
    study = ask("submit", "-", stdin=json.dumps(STUDY))
    id, experiment = study["id"], study["experiments"][0]["id"]
    assert ask("pause", id)["state"] == "PAUSED"
    assert ask("resume", id)["state"] == "QUEUED"
    assert ask("edit", id, "--name", "another")["name"] == "another"
    finish()
    assert ask("watch", id)["state"] == "COMPLETED"
    assert ask("extend", experiment, "--iterations", "3")["state"] == "QUEUED"
    assert ask("stop", experiment)["state"] == "COMPLETED"
    assert [each["state"] for each in ask("extend", id, "--repetitions", "4")["experiments"]] == ["QUEUED"] * 2
    assert ask("stop", id)["state"] == "COMPLETED"
    other = ask("submit", "-", stdin=json.dumps(STUDY | {"strategies": ["random"]}))["id"]
    assert ask("cancel", other)["state"] == "CANCELLED"
    assert [each["id"] for each in ask("list")] == [other, id]


def look(ask: Callable[..., Any], id: str, other: str) -> None:
    assert set(ask("show", id)) == {"study"}
    experiments = [each["id"] for each in ask("show", id)["study"]["experiments"]]
    assert set(ask("show", experiments[0])) == {"study", "repetitions", "provenance", "misfit"}
    assert [each["experiment"] for each in ask("curve", id)] == experiments
    assert [column["id"] for column in ask("diff", id, other)["columns"]] == [id, other]
    assert ask("report", id)["headline"]
    assert ask("compare", id)[0]["first"] == experiments[0]
    assert ask("spec", id)["spec"]["strategies"] == STUDY["strategies"]
    assert "strategies" in ask("catalogue")
    assert ask("catalogue", "random")["name"] == "random"
    assert {each["kind"] for each in ask("events", id)} > {"submitted", "completed"}
    assert {each["kind"] for each in ask("events", other)} == {"submitted", "cancelled"}


def keep(ask: Callable[..., Any], id: str, folder: Path) -> None:
    archive, figure = str(folder / "a.zip"), str(folder / "f.svg")
    assert ask("export", id, "--to", archive)["file"] == archive
    assert ask("import", archive)["renamed"]
    assert ask("rerun", archive)["state"] == "QUEUED"
    plugin = ask("plugin new", "strategy", "mine", "--folder", str(folder))["file"]
    assert ask("plugin check", plugin)[0]["name"] == "mine"
    assert drivers.load(Path(ask("plugin new", "driver", "mylab", "--folder", str(folder))["file"]))
    assert ask("figure", "curves", id, "--out", figure)[0]["bytes"] == Path(figure).stat().st_size


def test_versions_are_accepted_in_a_document(gaplab: Gaplab, study: str, sqlite_store: Store) -> None:
    (claim, *_) = execution.claim(sqlite_store, "test", limit=1)

    said = gaplab("accept-versions", claim.experiment_id, "--json")

    assert json.loads(said.out)["id"] == claim.experiment_id


def test_a_failure_is_on_standard_error_and_the_document_is_not_half_there(gaplab: Gaplab) -> None:
    said = gaplab("show", "nope", "--json")

    assert said.code == Exit.NOT_FOUND
    assert said.out == ""


@pytest.mark.parametrize(("failing", "state"), [(slice(None), "FAILED"), (slice(1), "COMPLETED")])
def test_a_failed_experiment_is_a_document_and_still_a_failure_for_the_shell(
    gaplab: Gaplab, study: str, sqlite_store: Store, finish: Callable[[], None], failing: slice, state: str
) -> None:
    claims = execution.claim(sqlite_store, "test", limit=10)
    those = list(dict.fromkeys(claim.experiment_id for claim in claims))[failing]
    for claim in claims:
        if claim.experiment_id in those:
            execution.fail(sqlite_store, claim, Failure("ValueError: the robot fell apart"))
        else:
            execution.hand_back(sqlite_store, claim)
    finish()

    said = gaplab("watch", study, "--json")
    retried = gaplab("retry", study, "--json")

    assert said.code == Exit.FAILED
    assert json.loads(said.out)["state"] == state
    assert "the robot fell apart" in said.err
    assert json.loads(retried.out)["state"] == {"FAILED": "QUEUED", "COMPLETED": "RUNNING"}[state]


def test_help_explains_every_exit_code(gaplab: Gaplab) -> None:
    said = gaplab("help", "exit-codes").out

    assert [int(line.split()[0]) for line in said.splitlines()] == [each.value for each in Exit]
    assert "watch" in gaplab("help").out
    assert gaplab("help", "nonsense").code == Exit.USAGE


def test_whatever_is_wrong_with_a_request_ends_as_that_and_not_as_a_failure_of_the_service() -> None:
    statuses = {*problems.STATUSES.values(), *(status for status, *_ in problems.FRAMEWORK.values())}
    refusals = {each for each in statuses if each < 500}

    assert refusals - {405} <= set(BY_STATUS)  # the command knows which methods there are
    assert (BY_STATUS[415], BY_STATUS[428], BY_STATUS[429]) == (Exit.INVALID, Exit.INVALID, Exit.CONFLICT)


def test_a_figure_is_drawn_into_as_many_files_as_one_names(
    gaplab: Gaplab, study: str, finish: Callable[[], None], tmp_path: Path
) -> None:
    finish()
    files = [tmp_path / "new" / f"a.{suffix}" for suffix in ("svg", "png", "pdf", "html", "json")]

    out = [argument for file in files for argument in ("-o", str(file))]
    said = gaplab("figure", "curves", study, *out, "--set", "title=A title", "-s", "each=true")

    assert said.code == 0, said.err
    assert said.out == "".join(f"Wrote {file}.\n" for file in files)
    svg, png, pdf, html, data = (file.read_bytes() for file in files)
    assert png.startswith(b"\x89PNG")
    assert pdf.startswith(b"%PDF")
    assert b"A title" in svg
    assert b"A title" in html
    assert json.loads(data)["title"] == "A title"


def test_a_figure_that_cannot_be_drawn_is_a_sentence_and_no_file(gaplab: Gaplab, study: str, tmp_path: Path) -> None:
    svg = str(tmp_path / "a.svg")
    wrong = [
        (["curves", study, "-o", str(tmp_path / "a.docx")], Exit.USAGE, "has another suffix; permitted: .svg"),
        (["curves", study, "-o", svg, "--set", "band"], Exit.USAGE, "NAME=VALUE"),
        (["curves", study, "-o", svg, "--set", "band=wide"], Exit.INVALID, "band"),
        (["curves", study, "-o", svg, "--set", "self=1"], Exit.INVALID, "unknown parameter 'self'"),
        (["portrait", study, "-o", svg], Exit.NOT_FOUND, "portrait"),
        (["curves", "nope", "-o", svg], Exit.NOT_FOUND, "nope"),
    ]

    for arguments, code, says in wrong:
        said = gaplab("figure", *arguments)
        assert (said.code, says in " ".join(said.err.replace("│", " ").split())) == (code, True), arguments
    assert list(tmp_path.iterdir()) == []


def test_an_option_that_no_replay_has_is_refused_by_its_name(gaplab: Gaplab, url: str, study: str) -> None:
    with Client(url) as client:
        experiment = client.study(study).experiments[0].id

    for name in ("id", "self", "file"):
        said = gaplab("replay", experiment, "-s", "iteration=1", "-s", f"{name}=2")

        assert said.code == Exit.INVALID
        assert f"unknown parameter '{name}'" in said.err


def test_all_about_one_plug_in(gaplab: Gaplab) -> None:
    said = gaplab("catalogue", "simulated_fit_and_informative")

    assert "informative_weight" in said.out
    assert "weight of the standard deviation of simulated fitness" in said.out
    assert "did you mean 'random'" in gaplab("catalogue", "randon").err


def test_each_detail_of_a_plug_in_has_a_line_in_words(gaplab: Gaplab) -> None:
    lines = gaplab("catalogue", "quadruped").out.splitlines()

    assert lines[0] == "quadruped"
    assert "controller: square_pulses, options (period_s 0.5)" in lines
    assert "tunables: none" in lines
    assert "function: no" in lines
    assert any(line.startswith("sensors: roll, unit rad, noise 0.02, period 6.28") for line in lines)
    assert any(line.startswith("reading_times_s: 0.75, 1, 1.25") for line in lines)


def test_ids_and_plug_ins_are_completed(url: str, study: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAPLAB_URL", url)
    monkeypatch.setattr(completion, "PATIENCE_S", 60.0)

    assert dict(completion.ids(study[:3]))[study] == "all [of] it (QUEUED)"
    assert len(completion.ids("")) == 3  # the study and its two experiments
    assert study not in dict(completion.experiments(""))
    assert len(completion.experiments("")) == 2
    assert [name for name, _ in completion.plugins("simulated_fit_and")] == [
        "simulated_fit_and_informative",
        "simulated_fit_and_unique",
    ]
    assert "curves" in completion.figures("cu")


def test_where_no_service_answers_nothing_is_offered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAPLAB_URL", "http://127.0.0.1:9")

    assert completion.ids("") == []
    assert completion.plugins("") == []


@pytest.mark.parametrize(
    "shell", ["bash", *(pytest.param(each, marks=pytest.mark.release) for each in ("zsh", "fish"))]
)
def test_the_shell_gets_a_script_and_the_script_gets_commands_and_ids(url: str, study: str, shell: str) -> None:
    def ask(**environment: str) -> str:
        command = [sys.executable, "-m", "gaplab"]
        shown = os.environ | {"GAPLAB_URL": url} | environment
        done = subprocess.run(command, env=shown, capture_output=True, text=True, check=False)
        assert "Traceback" not in done.stderr
        return done.stdout

    script = ask(_GAPLAB_COMPLETE=f"source_{shell}")

    assert f"_GAPLAB_COMPLETE=complete_{shell}" in script
    typed = {"bash": {"COMP_WORDS": "gaplab show ", "COMP_CWORD": "2"}}.get(
        shell, {"_TYPER_COMPLETE_ARGS": "gaplab show ", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    )
    offers = (ask(_GAPLAB_COMPLETE=f"complete_{shell}", **typed) for _ in range(20))  # a busy service has no offer
    assert any(study in offer for offer in offers)


def test_completion_installs_itself_for_the_shell_that_it_is_asked_from(tmp_path: Path) -> None:
    ask = f"'{sys.executable}' -m gaplab --install-completion; true"  # bash would become the last command itself
    environment = os.environ | {"HOME": str(tmp_path)}

    done = subprocess.run(["bash", "-c", ask], env=environment, capture_output=True, text=True, check=False)

    assert "bash completion installed" in done.stdout, done.stderr
    (script,) = (tmp_path / ".bash_completions").iterdir()
    assert script.name == "gaplab.sh"
    assert "complete_bash" in script.read_text()
    assert str(script) in (tmp_path / ".bashrc").read_text()


def test_in_a_log_watching_is_lines(gaplab: Gaplab, study: str, finish: Callable[[], None]) -> None:
    worker = threading.Timer(0.3, finish)
    worker.start()

    said = gaplab("watch", study, "--every", "0.1")

    worker.join()
    assert said.code == 0
    assert "all [of] it: COMPLETED" in said.out.splitlines()[-1]
    assert "\x1b" not in said.out


def test_in_a_terminal_it_is_a_view_of_curves_and_repetitions(url: str, study: str, finish: Callable[[], None]) -> None:
    shown_on = io.StringIO()
    screen = Console(force_terminal=True, width=140, file=shown_on, highlight=False)

    def finishing(snapshots: Iterator[Snapshot]) -> Iterator[Snapshot]:
        yield next(snapshots)
        finish()
        yield from snapshots

    with Client(url) as client:
        snapshots = client.snapshots(study, curves=True, every_s=0.1)
        ended = show(finishing(snapshots), screen, keep=True)

    shown = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", shown_on.getvalue())
    assert ended.state == "COMPLETED"
    assert "QUEUED" in shown
    assert "fitness in reality, m/s" in shown
    assert re.search(r"random .* COMPLETED .* ▁▄█ 3\.20±0\.20 after 2 +███ ", shown)  # three repetitions


class Shaky(httpx2.HTTPTransport):
    """A network on which the service is away for some of the requests after the first."""

    def __init__(self, away: int, back: Callable[[], None] = lambda: None) -> None:
        super().__init__()
        self.away = away
        self.back = back
        self.seen = False

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        if self.away and self.seen and "/studies/" in request.url.path:
            self.away -= 1
            if not self.away:
                self.back()
            msg = "away"
            raise httpx2.ConnectError(msg)
        self.seen |= "/studies/" in request.url.path
        return super().handle_request(request)


def test_the_view_survives_a_service_that_is_away_and_says_so(url: str, study: str, finish: Callable[[], None]) -> None:
    shown_on = io.StringIO()
    screen = Console(force_terminal=True, width=140, file=shown_on, highlight=False)

    with Client(url, transport=Shaky(2, finish)) as client:
        ended = client.show(study, screen, curves=True, every_s=0.1, patience_s=60)

    assert ended.state == "COMPLETED"
    assert "the service has not answered for" in shown_on.getvalue()


def test_it_is_waited_for_only_so_long_and_a_refusal_not_at_all(url: str, study: str) -> None:
    with Client(url, transport=Shaky(99)) as client, pytest.raises(ServiceUnreachable):
        list(client.snapshots(study, every_s=0.05, patience_s=0.1))
    with Client(url) as client, pytest.raises(ServiceError):
        next(client.snapshots("nope", every_s=0.1, patience_s=60))


def test_numbers_become_blocks() -> None:
    assert spark([0, 1, 2], 0, 2) == "▁▅█"
    assert spark([3, 3], 3, 3) == "▁▁"
