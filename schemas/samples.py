"""Tables of samples that were measured before an experiment, and what is wrong with their lines."""

from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.schemas.measurements import KnownSample


class CellError(Frozen):
    """One error in a table."""

    line: int = Field(description="line of the file, from 1; the header is line 1", examples=[4])
    column: str | None = Field(
        default=None, description="name of the column; null for the whole line", examples=["gene_2"]
    )
    value: str | None = Field(default=None, description="the cell as it is in the file", examples=["1,5"])
    message: str = Field(examples=["'1,5' is no number; decimals have a point"])
    permitted: str | None = Field(default=None, examples=["0 to 1"])


class SamplesRead(Frozen):
    """The samples of a table, for `reality.samples` of a spec; with any error there are none."""

    samples: tuple[KnownSample, ...]
    errors: tuple[CellError, ...] = Field(description="everything that is wrong, in the order of lines")
    more: int = Field(default=0, description="number of further errors that are left out")
