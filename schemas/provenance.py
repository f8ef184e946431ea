"""Under what an experiment was computed."""

from pydantic import Field

from gaplab.schemas.base import Frozen, Moment


class Provenance(Frozen):
    """The software and the machine of a supervisor, whose nodes have the same."""

    gaplab: str = Field(examples=["0.1.0"])
    code: str = Field(description="changes with any line of the code that numbers depend on", examples=["a1b2c3d4"])
    commit: str | None = Field(default=None, description="of git, if the code is checked out", examples=["3b875b0d"])
    dirty: bool | None = Field(default=None, description="whether the checked-out code was changed since that commit")
    python: str = Field(examples=["3.11.14"])
    libraries: dict[str, str] = Field(examples=[{"numpy": "2.4.6", "scipy": "1.17.1"}])
    engines: dict[str, str] = Field(
        description="by engine, its library and the version of it", examples=[{"pybullet": "pybullet 3.2.7"}]
    )
    architecture: str = Field(examples=["x86_64"])
    processor: str = Field(examples=["AMD EPYC 9555"])
    system: str = Field(examples=["Linux-6.8.0-x86_64-with-glibc2.36"])
    spec_version: int
    plugins: dict[str, str] = Field(
        default={}, description="modules from outside gaplab and what is in packages, each with a hash of its content"
    )
    outside: dict[str, str] = Field(
        default={}, description="by kind and name, the file of each of these plug-ins, with its hash"
    )


class ProvenanceUse(Frozen):
    """That repetitions of an experiment were claimed under this, the first of them at that moment."""

    id: str = Field(examples=["5f1d8a7b0c3e2946"])
    since: Moment
    repetitions: int = Field(description="those whose latest claim was under it")
    provenance: Provenance


class ProvenanceRead(Frozen):
    """Under what an experiment was computed: nothing as long as it has not begun."""

    computed_with: str | None = Field(
        default=None,
        description="engines, machine, version of the spec, own plug-ins; a supervisor with others leaves it alone",
        examples=["pybullet (pybullet 3.2.7), x86_64, spec 1"],
    )
    refused_by: str | None = Field(
        default=None,
        description="what a supervisor has that has left it alone",
        examples=["pybullet (pybullet 3.3.0), x86_64, spec 1"],
    )
    uses: tuple[ProvenanceUse, ...] = ()
