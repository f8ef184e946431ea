"""The how-tos that want more than a clone, run as they stand: a Postgres, and a cluster."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from tests.e2e.elsewhere import PASSWORD, Postgres, Shell
from tests.e2e.reading import DOCUMENTS, ROOT, blocks
from tests.ports import free_port
from tests.waiting import wait_until

pytestmark = pytest.mark.release

POSTGRES, CLUSTER = (ROOT / "docs" / "how-to" / f"{name}.md" for name in ("postgres", "cluster"))
TINY = {"strategy": "random", "robot": "toy_function", "budget": "smoke"}
NO_DASHBOARD = " --include-dashboard false"
STRANGER = "import sys; from ray._raylet import GcsClient; GcsClient(address=sys.argv[1]).internal_kv_keys(b'', None)"


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[Any]:
    found = Postgres(folder)
    yield found
    found.close()


@pytest.fixture
def postgres(server: Any) -> Iterator[Any]:
    """A server on which nobody has made anything for gaplab."""
    yield server
    server.forget()


@pytest.fixture
def shell(postgres: Any) -> Iterator[Any]:
    """Opens shells in which one is the administrator of Postgres; short paths, for Ray has sockets there."""
    with TemporaryDirectory(prefix="gaplab-") as place, ExitStack() as opened:

        def open_shell(name: Any, **environment: Any) -> Any:
            given = {"PATH": str(postgres.commands), "RAY_TMPDIR": place, "RAY_USAGE_STATS_ENABLED": "0"}
            found = Shell(Path(place) / name, **given | postgres.environment | environment)
            opened.callback(found.close)
            return found

        yield open_shell


def paragraphs(path: Any, **placeholders: Any) -> Iterator[Any]:
    """What a document has its readers run apart, with what they put in: lines for each place that they are typed at."""
    for block in blocks(path):
        for lines in block.paragraphs() if block.mark == "run apart" else ():
            for name, value in placeholders.items():
                lines = [line.replace(name, value) for line in lines]
            yield lines


def complete(gaplab: Any) -> Any:
    """The id of a new experiment that was computed."""
    id_ = gaplab.submit(TINY).id  # type: ignore[attr-defined]
    gaplab.wait(id_, timeout_s=200)  # raises if it fails  # type: ignore[attr-defined]
    return id_


def test_what_is_said_of_postgres_can_be_done(postgres: Any, shell: Any) -> None:
    whole, parts = paragraphs(POSTGRES, PASSWORD=PASSWORD, HOST=postgres.host)
    reader = shell("reader", GAPLAB_WORKERS="1")

    with reader.following(whole) as gaplab:
        before = complete(gaplab)
    with reader.following(parts) as gaplab:
        after = complete(gaplab)
        kept = [each.id for each in gaplab.studies().items]

    assert kept == [after, before]
    assert postgres.stored() == 2
    wait_until(lambda: not reader.processes(), otherwise=reader.processes)


def test_what_is_said_of_a_cluster_can_be_done(postgres: Any, shell: Any) -> None:
    port = str(free_port())
    put_in = {"PASSWORD": PASSWORD, "@HOST": f"@{postgres.host}", "HEAD": "127.0.0.1", "6379": port}
    at_head, at_node, beside = paragraphs(CLUSTER, **put_in)
    head = shell("head", RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER="0")  # to its drivers 127.0.0.1 is what they are told
    node = shell("node")
    create, *_ = paragraphs(POSTGRES)
    for line in create[:2]:
        head.run(line)

    for line in at_head:
        head.run(sized(line, cores=0) + NO_DASHBOARD * ("--head" in line))
    shutil.copytree(head.home / ".ray", node.home / ".ray")
    for line in at_node:
        node.run(sized(line, cores=1))
    with head.following(beside) as gaplab:
        complete(gaplab)

    assert postgres.stored() == 1
    assert len(list(head.home.parents[1].glob("ray/session_2*"))) == 1  # no Ray but this one
    assert (node.home / ".ray" / "auth_token").stat().st_mode & 0o77 == 0
    assert "AuthenticationError" in asked_without_token(f"127.0.0.1:{port}")


def sized(line: Any, cores: Any) -> Any:
    """Nodes as small as they can be; all the cores are at the second, which so must have computed what was computed."""
    return f"{line} --num-cpus {cores} --object-store-memory 100000000" if "ray start" in line else line


def asked_without_token(address: Any) -> Any:
    """What is said to a stranger."""
    without = {name: value for name, value in os.environ.items() if not name.startswith("RAY_")}
    call = [sys.executable, "-c", STRANGER, address]
    environment = without | {"RAY_AUTH_MODE": "disabled"}
    return subprocess.run(call, env=environment, capture_output=True, text=True, timeout=60, check=False).stderr


def test_every_document_that_is_run_apart_is_run_here() -> None:
    assert {path for path in DOCUMENTS if any(each.mark == "run apart" for each in blocks(path))} == {POSTGRES, CLUSTER}
