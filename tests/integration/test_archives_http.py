"""Archives over HTTP and by the command."""

import stat
from io import BytesIO
from pathlib import Path
from typing import IO
from zipfile import ZipFile

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.api.commands import archives as archive_commands
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import run, submit_one, toy


@pytest.fixture
def api(sqlite_store: Store) -> TestClient:
    return TestClient(create_app(sqlite_store))


@pytest.fixture
def submitted(sqlite_store: Store) -> str:
    """An experiment that is complete."""
    found = submit_one(sqlite_store, toy()).id
    for claim in execution.claim(sqlite_store, "me", 9):
        run(sqlite_store, claim)
    return found


def test_an_export_says_what_it_is_and_how_large(api: TestClient, submitted: str) -> None:
    answer = api.get(f"/studies/{submitted}/export")

    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/zip"
    assert answer.headers["content-disposition"] == f'attachment; filename="gaplab-{submitted}.zip"'
    assert int(answer.headers["content-length"]) == len(answer.content)
    assert ZipFile(BytesIO(answer.content)).testzip() is None


def test_an_import_leads_to_what_it_stored(api: TestClient, submitted: str) -> None:
    archive = api.get(f"/studies/{submitted}/export").content

    answer = api.post("/import", content=archive)

    (new,) = answer.json()["experiments"]
    assert answer.status_code == 201
    assert answer.json()["renamed"] == {submitted: new}
    assert answer.headers["location"] == f"/studies/{new}"
    first, second = (api.get(f"/experiments/{each}/samples").json() for each in (submitted, new))
    assert first == second


def test_a_study_goes_the_same_way(api: TestClient) -> None:
    study = api.post("/studies", json={"robot": "toy_function", "budget": "smoke", "strategies": ["random"]}).json()

    answer = api.post("/import", content=api.get(f"/studies/{study['id']}/export").content)

    assert answer.headers["location"] == f"/studies/{answer.json()['study']}"
    assert answer.json()["called_off"] == answer.json()["experiments"]
    assert api.get(answer.headers["location"]).json()["state"] == "CANCELLED"


def test_what_there_is_not_cannot_be_exported(api: TestClient) -> None:
    assert api.get("/studies/none/export").status_code == 404


def test_only_its_owner_can_read_an_archive(url: str, submitted: str, tmp_path: Path) -> None:
    with Client(url) as client:
        client.export(submitted, tmp_path / "new.zip")

    assert stat.S_IMODE((tmp_path / "new.zip").stat().st_mode) == 0o600


def test_the_command_writes_an_archive_and_reads_it(gaplab: Gaplab, submitted: str, tmp_path: Path) -> None:
    file = tmp_path / "archive.zip"

    written = gaplab("export", submitted, "--to", str(file))
    read = gaplab("import", str(file))

    assert (written.code, read.code) == (0, 0)
    assert str(file) in written.out
    assert f"{submitted} is taken here" in read.err
    assert gaplab("show", read.out.strip()).code == 0


def test_the_command_says_that_an_archive_is_too_large_to_import(
    gaplab: Gaplab, submitted: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = gaplab("export", submitted, "--to", str(tmp_path / "small.zip"))
    monkeypatch.setattr(archive_commands, "MOST_BYTES_OF_IMPORT", 1_000)
    large = gaplab("export", submitted, "--to", str(tmp_path / "large.zip"))

    assert (small.code, small.err, large.code) == (0, "", 0)
    assert "bytes; gaplab import takes 1,000. gaplab backup copies any size" in large.err


def test_the_command_overwrites_no_file_and_leaves_no_half(gaplab: Gaplab, submitted: str, tmp_path: Path) -> None:
    (tmp_path / "precious.zip").write_text("precious")

    taken = gaplab("export", submitted, "--to", str(tmp_path / "precious.zip"))
    unknown = gaplab("export", "none", "--to", str(tmp_path / "none.zip"))

    assert (taken.code, unknown.code) == (7, 4)
    assert [each.name for each in tmp_path.iterdir()] == ["precious.zip"]
    assert (tmp_path / "precious.zip").read_text() == "precious"


def test_an_archive_that_is_being_written_has_not_its_name_yet(
    gaplab: Gaplab, submitted: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    meanwhile: list[str] = []
    export = Client.export

    def watched(self: Client, id: str, file: IO[bytes]) -> None:
        export(self, id, file)
        meanwhile.extend(each.name for each in tmp_path.iterdir())

    monkeypatch.setattr(Client, "export", watched)
    written = gaplab("export", submitted, "--to", str(tmp_path / "archive.zip"))

    assert written.code == 0, written.err
    assert len(meanwhile) == 1
    assert meanwhile != ["archive.zip"]
    assert [each.name for each in tmp_path.iterdir()] == ["archive.zip"]


def test_what_is_no_id_is_no_place_for_an_archive(gaplab: Gaplab, here: Path) -> None:
    assert gaplab("export", "../x").code == 4
    assert list(here.iterdir()) == []


def test_the_command_says_what_is_wrong_with_an_archive(gaplab: Gaplab, tmp_path: Path) -> None:
    (tmp_path / "bad.zip").write_text("no zip")

    said = gaplab("import", str(tmp_path / "bad.zip"))

    assert said.code == 5
    assert "not a readable zip" in said.err
    assert gaplab("import", str(tmp_path / "none.zip")).code == 7
