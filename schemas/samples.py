"""Tables of samples that were measured before an experiment, and what is wrong with their lines."""

from pathlib import Path
from typing import Any, Self

from pydantic import Field

from gaplab.schemas.base import Frozen, Read
from gaplab.schemas.measurements import KnownSample


class CellError(Frozen):
    """One error in a table."""

    line: int = Field(description="line of the file, from 1; the header is line 1", examples=[4])
    column: str | None = Field(None, description="name of the column; null for the whole line", examples=["gene_2"])
    value: str | None = Field(None, description="the cell as it is in the file", examples=["1,5"])
    message: str = Field(examples=["'1,5' is not a number; decimals have a point"])
    permitted: str | None = Field(None, examples=["0 to 1"])


class InvalidSamples(ValueError):
    """A table of samples has errors.

    Attributes:
        errors: each with its `line`, `column`, `value`, `message` and `permitted`.
    """

    def __init__(self, path: Path, errors: tuple[Any, ...], more: int) -> None:
        self.errors = errors
        self._made_of = path, errors, more
        lines = [
            f"{path.name}:{each.line}{f', {each.column}' if each.column else ''}: {each.message}" for each in errors
        ]
        super().__init__("\n".join([*lines, *([f"and {more} more"] if more else [])]))

    def __reduce__(self) -> tuple[type[Self], tuple[Path, tuple[Any, ...], int]]:
        """Return the class and the arguments from which a copy of the error is made."""
        return type(self), self._made_of


class SamplesRead(Read):
    """The samples of a table, for `reality.samples` of a spec; with any error there are none."""

    samples: tuple[KnownSample, ...]
    errors: tuple[CellError, ...] = Field(description="everything that is wrong, in the order of lines")
    more: int = Field(0, description="number of further errors that are left out")

    def checked(self, file: Path) -> list[dict[str, Any]]:
        """Return the samples as `reality.samples` of a spec takes them.

        Args:
            file: the table, for the message.

        Raises:
            InvalidSamples: it has errors; all are named.
        """
        if self.errors:
            raise InvalidSamples(file, self.errors, self.more)
        return [sample.model_dump(mode="json", exclude_none=True) for sample in self.samples]
