"""Studies and experiments as the client returns them: values that also have the client's methods, about themselves."""

from base64 import b64encode
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import PrivateAttr

from gaplab.api.clients.errors import ServiceError, ServiceUnreachable
from gaplab.api.clients.figures import Figure, FigureOption
from gaplab.api.clients.results import Comparisons
from gaplab.schemas.base import Read, table
from gaplab.schemas.curves import Curve
from gaplab.schemas.editing import DeletionRead
from gaplab.schemas.records import ExperimentRead, StudyRead
from gaplab.schemas.reports import VerdictRead

if TYPE_CHECKING:
    import pandas

    from gaplab.api.clients.client import Client


class Kept(Read):
    """What a client keeps up with: a study, or one experiment of it.

    Methods do what the client's of the same name do, and raise the same errors. Those that change something return the
    study after the change; the object itself stays as it was read.
    """

    id: str
    _client: "Client | None" = PrivateAttr(None)

    def model_post_init(self, context: Any, /) -> None:  # noqa: ANN401 - as pydantic says
        """Keep the client that has read it."""
        self._client = (context or {}).get("client")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Kept) and dict(self) == dict(other)

    @property
    def client(self) -> "Client":
        """The client that has read it; ValueError says that it comes from another process."""
        if self._client is None:
            raise ValueError(f"no client of this process has read {self.id}; read it with client.study({self.id!r})")
        return self._client

    def wait(self, *, progress: bool | None = None, timeout_s: float | None = None) -> "Study":
        """Wait until it has completed, with its progress shown in a terminal or a notebook; return the study."""
        return self.client.wait(self.id, progress=progress, timeout_s=timeout_s)

    def verdict(self, *, margin: float | None = None, margin_of_direct: float | None = None) -> VerdictRead:
        """Return what its curves and tests say, in words, as the page and the report do."""
        return self.client.verdict(self.id, margin=margin, margin_of_direct=margin_of_direct)

    def curve(self, *, each: bool = False) -> "pandas.DataFrame":
        """Return fitness in reality against the number of real-world evaluations, perhaps of `each` repetition."""
        return self.client.curve(self.id, each=each)

    def curves(self, fitness: str = "recorded") -> tuple[Curve, ...]:
        """Return the curves of its experiments; `fitness` is recorded, transferred or equal_chances."""
        return self.client.curves(self.id, fitness)

    def compare(self, first: int | None = None, last: int | None = None, *, margin: float | None = None) -> Comparisons:
        """Compare every pair of its experiments after these numbers of real-world evaluations."""
        return self.client.compare(self.id, first, last, margin=margin)

    def samples(self, *, repetition: int | None = None, kind: str | None = None) -> "pandas.DataFrame":
        """Return the real-world evaluations of an experiment, or of a study of one, with a column for each gene."""
        return self.client.samples(self.id, repetition=repetition, kind=kind)

    def simulators(self, *, repetition: int | None = None, iteration: int | None = None) -> "pandas.DataFrame":
        """Return the tuned simulators of an experiment, or of a study of one, with a column for each tunable."""
        return self.client.simulators(self.id, repetition=repetition, iteration=iteration)

    def figure(self, of: str = "curves", **options: FigureOption) -> Figure:
        """Return a figure of it; the options are those of docs/figures.md."""
        return self.client.figure(self.id, of=of, **options)

    def save(self, file: str | Path) -> Path:
        """Write everything that is stored about it into a new file: an archive, which any service imports."""
        self.client.export(self.id, file)
        return Path(file)

    def pause(self) -> "Study":
        """Pause it once its current steps end."""
        return self.client.pause(self.id)

    def resume(self) -> "Study":
        """Continue it after a pause."""
        return self.client.resume(self.id)

    def stop(self) -> "Study":
        """Complete it with its results so far, once its current steps end."""
        return self.client.stop(self.id)

    def cancel(self) -> "Study":
        """Cancel it at once."""
        return self.client.cancel(self.id)

    def retry(self) -> "Study":
        """Queue its FAILED repetitions once more, from their stored steps."""
        return self.client.retry(self.id)

    def extend(self, *, iterations: int | None = None, repetitions: int | None = None, yes: bool = False) -> "Study":
        """Extend it to these totals once it has completed; with `yes`, whatever it costs."""
        return self.client.extend(self.id, iterations=iterations, repetitions=repetitions, yes=yes)

    def archive(self) -> "Study":
        """Leave a study that has ended out of lists."""
        return self.client.archive(self.id)

    def delete(self) -> DeletionRead:
        """Delete it for good, once it has ended."""
        return self.client.delete(self.id)

    def _repr_html_(self) -> str:
        """Return its line, its experiments and, if the service can be asked, the verdict and the curves."""
        parts = [escape(repr(self)), table(self.experiments if isinstance(self, StudyRead) else (self,))]
        with suppress(ServiceError, ServiceUnreachable, ValueError, RuntimeError):  # it has no client, or a closed one
            drawn = b64encode(self.figure(caption=False).content("svg")).decode()
            parts += [escape(self.verdict().headline), f"<img src='data:image/svg+xml;base64,{drawn}' alt='curves'/>"]
        return "<br/>".join(parts)


class Experiment(Kept, ExperimentRead):
    """One experiment of a study."""

    def refresh(self) -> "Experiment":
        """Return it as it is now."""
        return self.client.experiment(self.id)


class Study(Kept, StudyRead):
    """A study as it was read, with the methods of the client that are about it. An `Experiment` of it has the same."""

    experiments: tuple[Experiment, ...]

    def refresh(self) -> "Study":
        """Return it as it is now."""
        return self.client.study(self.id)
