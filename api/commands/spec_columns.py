"""The resolved specs of a file: an archive, or a spec to submit."""

import json
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from pydantic import ValidationError

from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.plugins import folders
from gaplab.services.specs.differences import SpecColumn
from gaplab.services.specs.resolution import resolve_experiment, resolve_study

MOST_BYTES = 50_000_000
"""Size of the specs in an archive; a spec has about two thousand bytes."""


def column_of(file: Path) -> SpecColumn:
    """Return the specs of an archive, or the completed specs of a JSON file, for which no service is needed.

    Raises:
        CommandError: the file cannot be read, or is neither of the two.
        InvalidSpec: the spec is invalid.
    """
    try:
        if file.suffix == ".zip":
            return SpecColumn(file.name, file.stem, _archived(file))
        spec = json.loads(file.read_text("utf-8"))
        folders.find()
        return SpecColumn(file.name, spec.get("name") or file.stem, _completed(spec))
    except OSError as error:
        raise CommandError(f"{file}: {error.strerror or error}", Exit.FILE) from error
    except ValidationError as error:
        mistakes = (f"/{'/'.join(map(str, wrong['loc']))}: {wrong['msg']}" for wrong in error.errors())
        raise CommandError(f"{file} is not a valid spec: {'; '.join(mistakes)}", Exit.INVALID) from error
    except (ValueError, KeyError, AttributeError, BadZipFile, RecursionError) as error:
        msg = f"{file} is neither an archive of gaplab (.zip) nor a spec (.json): {error}"
        raise CommandError(msg, Exit.FILE) from error


def _archived(file: Path) -> tuple[dict[str, Any], ...]:
    with ZipFile(file) as archive, archive.open("experiment.jsonl") as rows:
        text = rows.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise ValueError(f"its specs have more than {MOST_BYTES:,} bytes")
    return tuple(json.loads(row)["spec"] for row in text.splitlines())


def _completed(spec: dict[str, Any]) -> tuple[dict[str, Any], ...]:
    is_experiment = "strategy" in spec and "strategies" not in spec
    resolved = [resolve_experiment(ExperimentSpec.model_validate(spec))] if is_experiment else None
    studied = resolved or resolve_study(StudySpec.model_validate(spec))
    return tuple(each.model_dump(mode="json") for each in studied)
