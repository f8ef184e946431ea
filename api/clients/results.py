"""Results of experiments: curves, comparisons and misfit."""

from collections.abc import Iterator, Sequence
from typing import TypeAlias

from pydantic import BaseModel

from gaplab.api.clients.comparisons import Comparisons
from gaplab.api.clients.connection import Connection, Of, Parameter, id_of, segment
from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.records import Page
from gaplab.schemas.results import Curve, MisfitRead, SimulatorRead

Several: TypeAlias = Of | Sequence[Of]

PAGE = 5_000
"""Samples or simulators of one request: the most that the service permits."""

MOST_CURVES = 100
"""Ids of one request: the most that the service permits."""


class Results:
    """Results of experiments, from the service's records of steps."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def best_simulator(self, of: Of) -> SimulatorRead | None:
        """Return the tuned simulator of the latest iteration with the smallest error; None if there is none yet."""
        simulators = self._connection.items(Page[SimulatorRead], f"/experiments/{segment(of)}/simulators", limit=PAGE)
        best = [each for each in simulators if each.rank == 0 and each.error is not None]
        latest = max((each.iteration for each in best), default=0)
        return min(
            (each for each in best if each.iteration == latest),
            key=lambda each: (each.error, each.repetition),
            default=None,
        )

    def curves(self, of: Several, fitness: str = "recorded") -> tuple[Curve, ...]:
        """Return the curves of all experiments of studies, and of single experiments, in this order.

        Args:
            of: studies and experiments; or a single one.
            fitness: recorded as in the paper, `transferred` controllers alone, or the best of these so far,
                `equal_chances`.
        """
        found = (self._connection.get(tuple[Curve, ...], "/curves", study=ids, fitness=fitness) for ids in _parts(of))
        return tuple(curve for part in found for curve in part)

    def curves_csv(self, of: Several) -> str:
        """Return the curves of studies and experiments as CSV."""
        requests = ({"study": part, "format": "csv"} for part in _parts(of))
        first, *others = (self._connection.get_bytes("/curves", **request).decode() for request in requests)
        return first + "".join(other.partition("\n")[2] for other in others)  # the header stands once

    def compare(  # noqa: PLR0913 - each is a parameter of the operation
        self,
        of: Several,
        first: int | None = None,
        last: int | None = None,
        *,
        margin: float | None = None,
        margin_of_direct: float | None = None,
        intervals: bool | None = None,
        fitness: str = "recorded",
    ) -> Comparisons:
        """Compare every pair of experiments, one value for each repetition: over a range, its mean.

        Each p is given before and after Holm's correction over all pairs. `trusted` of a pair is the test by which to
        judge it: paired if both experiments draw the same random numbers. Over a range, `pooled` has the paper's tests,
        whose p are too small.

        Args:
            of: studies, for all of their experiments, and single experiments; or a single study.
            first: first number of real-world evaluations; left out: `last`.
            last: last number; left out: the last that all experiments have.
            margin: difference in the unit of fitness; `equivalence` of a pair says whether it differs by less.
            margin_of_direct: the same margin as a share of the direct baseline's mean fitness, like 0.03.
            intervals: with intervals; left out: for up to 20 experiments.
            fitness: whose fitness counts, as in `curves`.
        """
        query: dict[str, Parameter] = {"study": _ids(of), "from": first, "to": last}
        query |= {"margin": margin, "margin_of_direct": margin_of_direct, "intervals": intervals, "fitness": fitness}
        return Comparisons(self._connection.get(tuple[Comparison, ...], "/comparisons", **query))

    def diff(self, *of: Of) -> SpecDiff:
        """Return the settings in which studies and experiments differ; of a single study, its experiments."""
        return self._connection.get(SpecDiff, "/differences", study=_ids(of))

    def misfit(self, of: Of) -> MisfitRead:
        """Return how far the tuned simulators of an experiment are from reality and from each other."""
        return self._connection.get(MisfitRead, f"/experiments/{segment(of)}/misfit")

    def misfit_csv(self, of: Of) -> str:
        """Return the misfit of an experiment as CSV: a line for each iteration and each number over repetitions."""
        return self._connection.get_bytes(f"/experiments/{segment(of)}/misfit", format="csv").decode()


def _ids(of: Several) -> list[str]:
    """Return the ids of studies and experiments; a single one, which may be a sequence of letters, is one of them."""
    return [id_of(of)] if isinstance(of, str | BaseModel) else list(map(id_of, of))


def _parts(of: Several) -> Iterator[list[str]]:
    """Split the ids into requests; no ids at all are one request, for the service to refuse."""
    ids = _ids(of)
    for start in range(0, len(ids) or 1, MOST_CURVES):
        yield ids[start : start + MOST_CURVES]
