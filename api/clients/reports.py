"""Reports and verdicts, which the service computes."""

from pathlib import Path

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.records import Records, path_of
from gaplab.schemas.reports import VerdictRead

FORMATS = ("html", "pdf")


class Reports:
    """Reports on studies and experiments."""

    def __init__(self, connection: Connection, records: Records) -> None:
        self._connection = connection
        self._records = records

    def verdict(self, id: str, *, margin: float | None = None, margin_of_direct: float | None = None) -> VerdictRead:
        """Return the verdict on a study or an experiment: what its curves and tests say, in words.

        Args:
            id: id of the study or the experiment.
            margin: difference in the unit of fitness within which strategies are equivalent; left out: not tested.
            margin_of_direct: the same margin as a share of the direct baseline's mean fitness, like 0.03.
        """
        query = {"margin": margin, "margin_of_direct": margin_of_direct}
        return self._connection.get(VerdictRead, f"{path_of(self._records.find(id))}/report", format="json", **query)

    def save(
        self, id: str, file: str | Path, *, margin: float | None = None, margin_of_direct: float | None = None
    ) -> Path:
        """Write the report on a study or an experiment into a file with the suffix .html or .pdf.

        The margins are those of `verdict`. Missing folders are created.
        """
        path = Path(file)
        if (format_ := path.suffix.removeprefix(".").lower()) not in FORMATS:
            raise ValueError(f"{path} has no suffix of a report; permitted: {', '.join(FORMATS)}")
        query = {"margin": margin, "margin_of_direct": margin_of_direct}
        return self._connection.save(path, f"{path_of(self._records.find(id))}/report", format=format_, **query)

    def take_home(self, id: str, file: str | Path) -> Path:
        """Write what an experiment found into a file with the suffix .zip, or a page to print into one with .html.

        The zip has the best measured controller with its motion, the tuned simulator with its intervals, the verdict,
        samples, spec, provenance and the page. Missing folders are created.
        """
        path = Path(file)
        if (format_ := path.suffix.removeprefix(".").lower()) not in ("zip", "html"):
            raise ValueError(f"{path} has another suffix; permitted: zip, html")
        return self._connection.save(path, f"/experiments/{segment(id)}/takehome", format=format_)
