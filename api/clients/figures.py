"""Figures as a client has them: shown in a notebook, saved as a file's suffix says."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from gaplab.schemas.records import ExperimentRead, StudyRead

if TYPE_CHECKING:
    from gaplab.api.clients.client import Client

_FIGURES = "/figures/"

FORMATS = ("svg", "png", "pdf", "html", "json")


class _Described(BaseModel):
    """Of what a service says of itself, the addresses."""

    paths: dict[str, Any]


class Figure:
    """A figure, drawn by the service when it is first looked at, and kept: what one saw is what one saves.

    Args:
        kind: of figure.
        ids: whose.
        draw: gives it in a format.
    """

    def __init__(self, kind: str, ids: tuple[str, ...], draw: Callable[[str], bytes]) -> None:
        self.kind = kind
        self.ids = ids
        self._draw = draw
        self._drawn: dict[str, bytes] = {}

    def __repr__(self) -> str:
        return f"<figure {self.kind} of {', '.join(self.ids)}>"

    def content(self, format: str) -> bytes:  # noqa: A002 - as the API says
        """The figure as a file of this format: svg, png, pdf, html or json."""
        if format not in FORMATS:
            msg = f"there is no format {format!r} of figures; there is {', '.join(FORMATS)}"
            raise ValueError(msg)
        if format not in self._drawn:
            self._drawn[format] = self._draw(format)
        return self._drawn[format]

    def save(self, file: str | Path) -> Path:
        """Write it into a file, in the format that its suffix names; folders that are missing are made."""
        path = Path(file)
        content = self.content(path.suffix.removeprefix(".").lower())
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        return path

    def plotly(self) -> Any:  # noqa: ANN401 - Plotly has no types
        """The same as a figure of Plotly, to zoom into, or to change."""
        from plotly.graph_objects import Figure as PlotlyFigure

        return PlotlyFigure(json.loads(self.content("json"))["figure"])

    def _repr_mimebundle_(self, **_: object) -> dict[str, str]:
        """What a notebook shows: the drawing itself, which stays in the notebook's file."""
        return {"image/svg+xml": self.content("svg").decode(), "text/plain": repr(self)}


class Figures:
    """A part of the client; its methods raise what the client's do."""

    def figure(self: "Client", *ids: str, of: str = "curves", **options: str | float | bool | None) -> Figure:
        """A figure of experiments and studies.

        Args:
            ids: of experiments, or of studies for all of their experiments.
            of: what is drawn, like "curves" or "predictions"; `figure_kinds` lists them.
            options: of that kind, like band="sd" or title="…"; docs/figures.md says which.

        Raises:
            ServiceError: there is no such id; no such kind and no such option show when the figure is looked at.
        """
        found = [self.find(each) for each in ids]
        which = {
            "study": [each.id for each in found if isinstance(each, StudyRead)],
            "experiment": [each.id for each in found if isinstance(each, ExperimentRead)],
        }
        asked: dict[str, Any] = {name: those for name, those in which.items() if those} | options

        def draw(format: str) -> bytes:  # noqa: A002 - as the API says
            return self._get(f"{_FIGURES}{of}", **asked, format=format).content

        return Figure(of, ids, draw)

    def figure_kinds(self: "Client") -> tuple[str, ...]:
        """The kinds of figures that the service draws."""
        paths = self._read(_Described, self._get("/openapi.json")).paths
        return tuple(path.removeprefix(_FIGURES) for path in paths if path.startswith(_FIGURES))
