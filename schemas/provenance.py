"""Under what an experiment was computed."""

from datetime import datetime

from pydantic import Field

from gaplab.schemas.base import Frozen


class Provenance(Frozen):
    """The software and the machine of a supervisor, whose nodes have the same."""

    gaplab: str
    code: str = Field(description="changes with any line of the code that numbers depend on")
    commit: str | None = Field(default=None, description="of git, if the code is checked out")
    dirty: bool | None = Field(default=None, description="whether the checked-out code was changed since that commit")
    python: str
    libraries: dict[str, str]
    engines: dict[str, str] = Field(description="by engine, its library and the version of it")
    architecture: str
    processor: str
    system: str
    spec_version: int
    plugins: dict[str, str] = Field(
        default={}, description="modules from outside gaplab and what is in packages, each with a hash of its content"
    )
    outside: dict[str, str] = Field(
        default={}, description="by kind and name, the file of each of these plug-ins, with its hash"
    )


class ProvenanceUse(Frozen):
    """That repetitions of an experiment were claimed under this, the first of them at that moment."""

    id: str
    since: datetime
    repetitions: int = Field(description="those whose latest claim was under it")
    provenance: Provenance


class ProvenanceRead(Frozen):
    """Under what an experiment was computed: nothing as long as it has not begun."""

    computed_with: str | None = Field(
        default=None,
        description="engines, machine, version of the spec, own plug-ins; a supervisor with others leaves it alone",
    )
    refused_by: str | None = Field(default=None, description="what a supervisor has that has left it alone")
    uses: tuple[ProvenanceUse, ...] = ()
