"""Provenance: the software and machines that computed an experiment."""

from datetime import datetime

from pydantic import Field

from gaplab.schemas.base import Frozen


class Provenance(Frozen):
    """Software and machine of a supervisor; all its nodes have the same software."""

    gaplab: str
    code: str = Field(description="hash of the code that numbers depend on")
    commit: str | None = Field(default=None, description="git commit, if the code runs from a clone")
    dirty: bool | None = Field(default=None, description="whether the clone has changes since that commit")
    python: str
    libraries: dict[str, str]
    engines: dict[str, str] = Field(description="library of each engine, with its version")
    architecture: str
    processor: str
    system: str
    spec_version: int
    plugins: dict[str, str] = Field(
        default={}, description="files of external plug-in folders, including data in packages, each with its hash"
    )
    outside: dict[str, str] = Field(default={}, description="file and hash of each external plug-in, by kind and name")


class ProvenanceUse(Frozen):
    """One provenance under which repetitions of an experiment were claimed, and when first."""

    id: str
    since: datetime
    repetitions: int = Field(description="number of repetitions whose latest claim was under this provenance")
    provenance: Provenance


class ProvenanceRead(Frozen):
    """Everything that computed an experiment; empty until it starts."""

    computed_with: str | None = Field(
        default=None,
        description="decisive versions: engines, architecture, spec, external plug-ins; others cannot continue it",
    )
    refused_by: str | None = Field(
        default=None, description="versions of a supervisor that did not claim the experiment because they differ"
    )
    uses: tuple[ProvenanceUse, ...] = ()
