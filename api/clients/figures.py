"""Figures that show themselves in a notebook and save themselves in the format of a file's suffix."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from pydantic import BaseModel, TypeAdapter

from gaplab.api.clients.connection import Connected, Of, id_of, written
from gaplab.api.clients.errors import format_of, library
from gaplab.services.figures.marks import FigureDefinition

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

_FIGURES = "/figures/"

OF_SEVERAL = ("curves", "coordinates")
"""Kinds of figures of studies; others are of one experiment."""

FORMATS = ("svg", "png", "pdf", "html", "json")


FigureOption: TypeAlias = str | float | bool | Sequence[Of | float] | Mapping[str, str] | None

TEXTS = {"xlim", "ylim", "order", "labels"}
"""Options that the service takes as a text."""


class _Paths(BaseModel):
    paths: dict[str, Any]


class Figure:
    """A figure that the service draws once per format, so that a saved file equals what was shown."""

    def __init__(self, kind: str, ids: tuple[str, ...], draw: Callable[[str], bytes]) -> None:
        self.kind = kind
        self.ids = ids
        self._draw = draw
        self._drawn: dict[str, bytes] = {}

    def __repr__(self) -> str:
        return f"<figure {self.kind} of {', '.join(self.ids)}>"

    def content(self, format: str) -> bytes:  # noqa: A002 - as the API says
        """Return the content of a file in this format: svg, png, pdf, html or json."""
        if format not in FORMATS:
            raise ValueError(f"unknown figure format {format!r}; available: {', '.join(FORMATS)}")
        if format not in self._drawn:
            self._drawn[format] = self._draw(format)
        return self._drawn[format]

    def save(self, file: str | Path) -> Path:
        """Write the figure into a file in the format of its suffix; missing folders are created."""
        return written(file, self.content(format_of(file, FORMATS)))

    def plotly(self) -> Any:  # noqa: ANN401 - Plotly has no types
        """Return the figure as a Plotly figure, to zoom or to change.

        Raises:
            ExtraMissing: plotly is not installed.
        """
        return library("plotly.graph_objects", "notebook").Figure(json.loads(self.content("json"))["figure"])

    def matplotlib(self) -> "Canvas":
        """Return the figure as matplotlib's, drawn here as a file would be, to change before `savefig`."""
        from gaplab.services.figures.matplotlib.files import Look, draw

        return draw(*TypeAdapter(tuple[FigureDefinition, Look]).validate_json(self._draw("marks")))

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """Return what a notebook shows: the drawing itself, which stays in the notebook's file."""
        return {"image/svg+xml": self.content("svg").decode(), "text/plain": repr(self)}


class Figures(Connected):
    """Figures that the service draws."""

    def figure(self, /, *what: Of, of: str = "curves", **options: FigureOption) -> Figure:
        """Return a figure of studies; the service draws it when it is shown or saved, and refuses what is unknown then.

        Args:
            what: studies, for all of their experiments, and single experiments.
            of: kind of figure, like "curves" or "predictions"; `figure_kinds` lists them.
            options: options of the kind, like band="sd", and of all: title, xlabel, ylabel, xlim=(0, 10), ylim, and of
                files width, height, caption, font and font_size. Curves also take labels={"random": "Chance"} and
                order=["random"], whose keys are ids, names or strategies. docs/figures.md lists all.

        Raises:
            TypeError: an option would change the format or the experiments.
        """
        if wrong := sorted({"format", "study", "experiment"} & options.keys()):
            msg = "give ids first, and the format as the suffix of the file that you save"
            raise TypeError(f"{', '.join(wrong)}: not an option of a figure; {msg}")
        ids = tuple(map(id_of, what))
        asked: dict[str, Any] = {name: _text(value) if name in TEXTS else value for name, value in options.items()}
        asked["study" if of in OF_SEVERAL else "experiment"] = ids

        def draw(format: str) -> bytes:  # noqa: A002 - as the API says
            return self._connection.get_bytes(f"{_FIGURES}{of}", **asked, format=format)

        return Figure(of, ids, draw)

    def figure_kinds(self) -> tuple[str, ...]:
        """Return the kinds of figures that the service draws."""
        paths = self._connection.get(_Paths, "/openapi.json").paths
        return tuple(path.removeprefix(_FIGURES) for path in paths if path.startswith(_FIGURES))


def _text(value: Any) -> str:  # noqa: ANN401 - a text, a mapping or a sequence
    """Return an option as a text: a mapping as JSON, other values with commas between them."""
    if isinstance(value, str | Mapping):
        return value if isinstance(value, str) else json.dumps(dict(value))
    return ",".join(f"{each}" if isinstance(each, int | float) else id_of(each) for each in value)
