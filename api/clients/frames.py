"""What the service knows as tables: frames of pandas, one row per observation, whole however many pages it is."""

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, TypeVar

from gaplab.api.clients.errors import ExtraMissing
from gaplab.api.clients.life_cycle import part
from gaplab.schemas.predictions import Prediction, Predictions
from gaplab.schemas.records import MeasurementKind, Page, SampleRead, SimulatorRead

if TYPE_CHECKING:
    import pandas

    from gaplab.api.clients.client import Client

T = TypeVar("T")

MOST = 5_000
"""Items of a page: as many as the service gives at a time."""

NUMBERS = ("evaluations", "n", "mean", "sd", "lower", "upper")


class Frames:
    """A part of the client; its methods raise what the client's do, and ExtraMissing without pandas."""

    def curve(self: "Client", *ids: str, each: bool = False) -> "pandas.DataFrame":
        """The curves of experiments and studies: fitness in reality against the number of real-world evaluations.

        Args:
            ids: of experiments, or of studies for all of their experiments.
            each: a row for each repetition in place of one for their mean, SD, n and 95 % interval.
        """
        frames = _pandas()
        curves = self.curves(ids)
        named = [({"experiment": of.experiment, "name": of.name, "strategy": of.strategy}, of.points) for of in curves]
        if each:
            columns: tuple[str, ...] = ("repetition", "evaluations", "fitness")
            rows = [
                names | {"repetition": repetition, "evaluations": point.evaluations, "fitness": value}
                for names, points in named
                for point in points
                for repetition, value in enumerate(point.values)
            ]
        else:
            columns = NUMBERS
            rows = [names | {of: getattr(point, of) for of in NUMBERS} for names, points in named for point in points]
        return _numeric(frames.DataFrame(rows, columns=["experiment", "name", "strategy", *columns]), columns)

    def samples(
        self: "Client",
        id: str,
        *,
        repetition: int | None = None,
        kind: str | None = None,
    ) -> "pandas.DataFrame":
        """Every real-world evaluation of an experiment, a row each: a column for each gene.

        Args:
            id: of the experiment.
            repetition: only of this one.
            kind: only "sample" (learned from) or "probe" (only looked at).
        """
        frames = _pandas()
        wanted = None if kind is None else MeasurementKind(kind)
        found = list(self._all(SampleRead, f"/experiments/{part(id)}/samples", repetition=repetition, kind=wanted))
        columns = ["repetition", "iteration", "kind", "fitness", "measured_by", "measured_at"]
        frame = frames.DataFrame(
            [each.model_dump(mode="python", include={*columns}) for each in found], columns=columns
        )
        frame["kind"] = frame["kind"].astype(str)
        genes = frames.DataFrame([each.genome for each in found], index=frame.index)
        return _numeric(frame.join(genes.rename(columns=lambda gene: f"gene_{gene}")), ["fitness"])

    def simulators(
        self: "Client",
        id: str,
        *,
        repetition: int | None = None,
        iteration: int | None = None,
    ) -> "pandas.DataFrame":
        """Every tuned simulator of an experiment, a row each, rank 0 the best of its iteration: a column a tunable.

        Args:
            id: of the experiment.
            repetition: only of this one.
            iteration: only of this one; 0 is the untuned start.
        """
        frames = _pandas()
        address = f"/experiments/{part(id)}/simulators"
        found = list(self._all(SimulatorRead, address, repetition=repetition, iteration=iteration))
        columns = ["repetition", "iteration", "rank", "squared_error"]
        frame = frames.DataFrame([each.model_dump(include={*columns}) for each in found], columns=columns)
        return _numeric(frame.join(frames.DataFrame([each.parameters for each in found], index=frame.index)), columns)

    def predictions(self: "Client", id: str, *, every_s: float = 0.5, timeout_s: float = 600.0) -> "pandas.DataFrame":
        """What simulators said of each sample of an experiment before and after it was measured, and what reality said.

        The service computes it when it is asked for the first time, and is waited for. Of very many samples it has
        those of the first repetitions.

        Args:
            id: of the experiment.
            every_s: how often it is asked whether all is computed.
            timeout_s: how long to wait at most.

        Raises:
            TimeoutError: it takes longer; what is computed is kept, ask again.
        """
        frames = _pandas()
        began = time.monotonic()
        while (found := self._read(Predictions, self._get(f"/experiments/{part(id)}/predictions"))).pending:
            if time.monotonic() - began > timeout_s:
                msg = f"{found.pending} predictions of {id} are not computed after {timeout_s:g} s; ask again"
                raise TimeoutError(msg)
            time.sleep(every_s)
        columns = list(Prediction.model_fields)
        return _numeric(frames.DataFrame([each.model_dump() for each in found.items], columns=columns), columns)

    def _all(self: "Client", of: type[T], address: str, /, **filters: str | int | None) -> Iterator[T]:
        """Every item of a list, page after page."""
        cursor = None
        while True:
            page = self._read(Page[of], self._get(address, limit=MOST, cursor=cursor, **filters))  # type: ignore[valid-type]
            yield from page.items
            if (cursor := page.next) is None:
                return


def _pandas() -> Any:  # noqa: ANN401 - a module
    try:
        import pandas
    except ImportError as error:
        raise ExtraMissing("pandas", "notebook") from error
    return pandas


def _numeric(frame: Any, columns: Any) -> Any:  # noqa: ANN401 - frames of a library that may be missing
    """The frame with these columns as numbers: what is null there becomes nan, even where all of a column is."""
    for name in columns:
        frame[name] = _pandas().to_numeric(frame[name])
    return frame
