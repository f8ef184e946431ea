"""The resolved specs of a file: an archive, or a spec to submit."""

from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gaplab.api.commands.exit_codes import CommandError, Exit
from gaplab.api.commands.submission import read_spec
from gaplab.schemas.mistakes import pointer_to, sentence
from gaplab.schemas.spec import ExperimentSpec, StudySpec, kind_of
from gaplab.services.archives.reading import archived_specs
from gaplab.services.core.errors import InvalidArchive, InvalidSpec
from gaplab.services.plugins import folders
from gaplab.services.specs.differences import SpecColumn
from gaplab.services.specs.resolution import resolve
from gaplab.services.specs.stored_specs import spec_of

_BROKEN_SPECS = (ValueError, KeyError, TypeError, AttributeError, RecursionError)


def column_of(file: Path) -> SpecColumn:
    """Return the specs of an archive, or the completed specs of a JSON file, for which no service is needed.

    Raises:
        CommandError: the file cannot be read, is damaged, or has an invalid spec.
    """
    try:
        if file.suffix == ".zip":
            return SpecColumn(file.name, file.stem, _archived(file))
        spec = read_spec(str(file))
        folders.load()
        return SpecColumn(file.name, spec.get("name") or file.stem, _completed(spec))
    except OSError as error:
        raise CommandError(f"{file}: {error.strerror or error}", Exit.FILE) from error
    except ValidationError as error:
        mistakes = (f"{pointer_to(wrong['loc']) or '/'}: {sentence(dict(wrong))}" for wrong in error.errors())
        raise CommandError(f"{file} is not a valid spec: {'; '.join(mistakes)}", Exit.INVALID) from error
    except InvalidSpec as error:
        raise CommandError(f"{file} is not a valid spec: {error}", Exit.INVALID) from error
    except InvalidArchive as error:
        raise CommandError(f"{file} is not an archive of gaplab: {error}", Exit.INVALID) from error


def _archived(file: Path) -> tuple[dict[str, Any], ...]:
    with file.open("rb") as source:
        specs = archived_specs(source)
    try:
        for spec in specs:
            spec_of(spec)
    except _BROKEN_SPECS as error:
        raise InvalidArchive("a spec in it is damaged") from error
    return specs


def _completed(spec: dict[str, Any]) -> tuple[dict[str, Any], ...]:
    kind = ExperimentSpec if kind_of(spec) == "experiment" else StudySpec
    return tuple(each.model_dump(mode="json") for each in resolve(kind.model_validate(spec)))
