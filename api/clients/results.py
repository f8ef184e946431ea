"""Results of experiments: curves, comparisons and misfit."""

from collections.abc import Iterator, Sequence

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.records import Records, experiments_of
from gaplab.schemas.curves import Comparison, Curve
from gaplab.schemas.misfit import MisfitRead
from gaplab.schemas.records import common_count

MOST_CURVES = 100
"""Experiments of one request: the most that the service permits."""


class Results:
    """Results of experiments, from the service's records of steps."""

    def __init__(self, connection: Connection, records: Records) -> None:
        self._connection = connection
        self._records = records

    def curves(self, ids: Sequence[str]) -> tuple[Curve, ...]:
        """Return the curves of experiments, and of all experiments of studies, in this order."""
        return self.curves_of(self._experiments(ids))

    def curves_of(self, experiments: Sequence[str]) -> tuple[Curve, ...]:
        """Return the curves of experiments, given by their ids, with one request per hundred."""
        parts = [self._connection.get(tuple[Curve, ...], "/curves", experiment=ids) for ids in _hundreds(experiments)]
        return tuple(curve for part in parts for curve in part)

    def curves_csv(self, ids: Sequence[str]) -> str:
        """Return the curves of experiments and studies as CSV."""
        requests = ({"experiment": part, "format": "csv"} for part in _hundreds(self._experiments(ids)))
        first, *others = (self._connection.get_bytes("/curves", **request).decode() for request in requests)
        return first + "".join(other.partition("\n")[2] for other in others)  # the header stands once

    def compare(
        self, experiments: Sequence[str], first: int | None = None, last: int | None = None
    ) -> tuple[Comparison, ...]:
        """Compare every pair of experiments after one number of real-world evaluations, or pooled over a range.

        Args:
            experiments: ids of two or more experiments.
            first: the number, or the first one of the range; left out: the last that the experiments share.
            last: the last number of the range; left out: `first`. A pooled range is the paper's test, whose p are too
                small: see `caution` of the result.
        """
        if first is None:
            first = last if last is not None else self.common_count(experiments)
        counts = {"from": first, "to": first if last is None else last}
        return self._connection.get(tuple[Comparison, ...], "/comparisons", experiment=list(experiments), **counts)

    def common_count(self, experiments: Sequence[str]) -> int:
        """Return the last number of real-world evaluations that experiments share; 0 without any result."""
        return common_count([self._records.experiment(id) for id in experiments]) or 0

    def misfit(self, id: str) -> MisfitRead:
        """Return how far the tuned simulators of an experiment are from reality and from each other."""
        return self._connection.get(MisfitRead, f"/experiments/{segment(id)}/misfit")

    def _experiments(self, ids: Sequence[str]) -> list[str]:
        return [experiment.id for id in ids for experiment in experiments_of(self._records.find(id))]


def _hundreds(experiments: Sequence[str]) -> Iterator[list[str]]:
    """Split the ids into requests; no ids at all are one request, for the service to refuse."""
    for start in range(0, len(experiments) or 1, MOST_CURVES):
        yield list(experiments[start : start + MOST_CURVES])
