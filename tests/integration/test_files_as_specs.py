"""Commands that read specs and archives from files, without a service: what a wrong file is answered with."""

import json
import sqlite3
import zipfile
from contextlib import closing
from pathlib import Path

import pytest

from gaplab.api.commands.exit_codes import Exit
from gaplab.services.archives.opening import DATABASE
from gaplab.services.store.session import new_database
from tests.archiving import packed
from tests.commands import Gaplab

GOOD = {"strategy": "random", "robot": "toy_function", "budget": "smoke"}


@pytest.fixture
def good(tmp_path: Path) -> str:
    file = tmp_path / "good.json"
    file.write_text(json.dumps(GOOD))
    return str(file)


def zipped(file: Path, text: str, member: str = DATABASE) -> bytearray:
    """Write a zip with a member of this text, and return its bytes."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(member, text)
    return bytearray(file.read_bytes())


def test_a_spec_with_an_unknown_name_is_invalid_and_its_file_is_named(
    gaplab: Gaplab, good: str, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text(json.dumps(GOOD | {"robot": "nope"}))

    said = gaplab("diff", str(bad), good)

    assert said.code == Exit.INVALID
    assert said.err.startswith(f"gaplab: {bad} is not a valid spec: /robot: unknown robot 'nope'")


def test_a_file_that_is_no_spec_is_told_like_by_submit(gaplab: Gaplab, good: str, tmp_path: Path) -> None:
    file = tmp_path / "spec.json"
    for text in ('{"seed": NaN}', "[1]", "{"):
        file.write_text(text)

        submitted, compared = gaplab("submit", str(file)), gaplab("diff", str(file), good)

        assert (compared.code, compared.err) == (Exit.FILE, submitted.err)


def test_a_wrong_value_in_a_spec_is_told_with_what_is_permitted(gaplab: Gaplab, good: str, tmp_path: Path) -> None:
    file = tmp_path / "spec.json"
    file.write_text(json.dumps(GOOD | {"seed": "x"}))

    said = gaplab("diff", str(file), good)

    assert said.err == f'gaplab: {file} is not a valid spec: /seed: seed must be a whole number, not "x"\n'


def test_a_damaged_an_encrypted_and_a_foreign_zip_are_sentences(gaplab: Gaplab, good: str, tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    content = zipped(file, "x" * 1000)
    damaged, encrypted, truncated = content.copy(), content.copy(), content.copy()
    damaged[30 + len(DATABASE)] = 0xFF
    for header, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        encrypted[encrypted.index(header) + flags] |= 1
    del truncated[-30:]

    for bytes_, reason in ((damaged, "error"), (truncated, "BadZipFile")):
        file.write_bytes(bytes_)
        said = gaplab("diff", str(file), good)
        assert said.code == Exit.INVALID
        assert said.err == f"gaplab: {file} is not an archive of gaplab: it is not a readable zip: {reason}\n"
    file.write_bytes(encrypted)
    assert "study.sqlite3 is encrypted" in gaplab("diff", str(file), good).err
    zipped(file, "{}", "other")
    assert "it has other\n" in gaplab("diff", str(file), good).err


def test_an_archive_with_a_spec_that_is_none_is_a_sentence(gaplab: Gaplab, good: str, tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    for spec in ("3", "{}", "[1]", "{", '{"reality": 1}', '"NaN"', "NaN"):
        file.write_bytes(archive_of(tmp_path / "study.sqlite3", spec))

        said = gaplab("diff", str(file), good)

        assert said.code == Exit.INVALID
        assert said.err.startswith(f"gaplab: {file} is not an archive of gaplab: ")
        assert said.err.count("\n") == 1


def archive_of(database: Path, spec: str) -> bytes:
    """An archive with an experiment whose spec is this text."""
    new_database(database)
    study = {"id": "a", "name": "a", "edits": 0, "created_at": "2026-01-01 00:00:00.000000"}
    experiment = {"id": "a", "study_id": "a", "position": 0, "name": "a", "strategy": "random", "state": "COMPLETED"}
    experiment |= {"spec": spec, "spec_version": 1, "iterations": 1, "rollouts": 1, "precedence": 0, "running": 0}
    experiment |= {"claimable": 0, **dict.fromkeys(("turn_at", "created_at"), study["created_at"])}
    with closing(sqlite3.connect(database)) as connection:
        for table, row in (("study", study), ("experiment", experiment)):
            connection.execute(
                f"INSERT INTO {table} ({', '.join(row)}) VALUES ({', '.join('?' * len(row))})", [*row.values()]
            )
        connection.commit()
    return packed(database.read_bytes())


def test_a_file_that_is_no_archive_cannot_be_computed_again(gaplab: Gaplab, tmp_path: Path) -> None:
    file = tmp_path / "a.zip"
    file.write_bytes(b"text")

    for said in (gaplab("rerun", str(file)), gaplab("rerun", str(file), "--verify")):
        assert said.code == Exit.INVALID
        assert said.err == f"gaplab: {file} is not an archive of gaplab: it is not a readable zip: BadZipFile\n"
