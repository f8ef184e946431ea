"""Provenance: the software and machines that computed an experiment."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Moment, Read


class Provenance(Frozen):
    """Software and machine of a supervisor; all its nodes have the same software."""

    gaplab: str = Field(examples=["0.1.0"])
    code: str = Field(description="hash of the code that numbers depend on", examples=["a1b2c3d4"])
    commit: str | None = Field(None, description="git commit, if the code runs from a clone", examples=["3b875b0d"])
    dirty: bool | None = Field(None, description="whether the clone has changes since that commit")
    python: str = Field(examples=["3.11.14"])
    libraries: dict[str, str] = Field(
        description="version of each library that numbers depend on, and the variables that choose its code",
        examples=[{"numpy": "2.4.6", "scipy": "1.17.1", "OPENBLAS_CORETYPE": "Haswell"}],
    )
    engines: dict[str, str] = Field(
        description="library of each engine, with its version", examples=[{"pybullet": "pybullet 3.2.7"}]
    )
    architecture: str = Field(examples=["x86_64"])
    processor: str = Field(examples=["AMD EPYC 9555"])
    system: str = Field(examples=["Linux-6.8.0-x86_64-with-glibc2.36"])
    spec_version: int
    plugins: dict[str, str] = Field(
        {}, description="files of external plug-in folders, including data in packages, each with its hash"
    )
    outside: dict[str, str] = Field({}, description="file and hash of each external plug-in, by kind and name")


class ProvenanceUse(Frozen):
    """One provenance under which repetitions of an experiment were claimed, and when first."""

    id: str = Field(examples=["5f1d8a7b0c3e2946"])
    since: Moment
    repetitions: int = Field(description="number of repetitions whose latest claim was under this provenance")
    provenance: Provenance


class ProvenanceRead(Read):
    """Everything that computed an experiment; empty until it starts."""

    computed_with: str | None = Field(
        None,
        description="decisive versions: engines, architecture, spec, external plug-ins; others cannot continue it",
        examples=["pybullet (pybullet 3.2.7), x86_64, spec 1"],
    )
    refused_by: str | None = Field(
        None,
        description="versions of a supervisor that did not claim the experiment because they differ",
        examples=["pybullet (pybullet 3.3.0), x86_64, spec 1"],
    )
    uses: tuple[ProvenanceUse, ...] = ()
