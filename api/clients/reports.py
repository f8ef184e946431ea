"""Reports and verdicts, which the service computes."""

from pathlib import Path

from gaplab.api.clients.connection import Connection, Of, segment
from gaplab.schemas.comparisons import VerdictRead


class Reports:
    """Requests for the verdict on a study, for its report, and for the files to take home."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def verdict(self, of: Of, *, margin: float | None = None, margin_of_direct: float | None = None) -> VerdictRead:
        """Return the verdict on a study: what its curves and tests say, in words.

        Args:
            of: the study, or one experiment of it.
            margin: difference in the unit of fitness within which strategies are equivalent; left out: not tested.
            margin_of_direct: the same margin as a share of the direct baseline's mean fitness, like 0.03.
        """
        query = {"margin": margin, "margin_of_direct": margin_of_direct}
        return self._connection.get(VerdictRead, f"/studies/{segment(of)}/report", format="json", **query)

    def save(
        self, of: Of, file: str | Path, *, margin: float | None = None, margin_of_direct: float | None = None
    ) -> Path:
        """Write the report on a study into a file with the suffix .html, to read and to print.

        The margins are those of `verdict`. Missing folders are created.
        """
        query = {"margin": margin, "margin_of_direct": margin_of_direct}
        return self._connection.save(file, f"/studies/{segment(of)}/report", ("html",), **query)

    def take_home(self, of: Of, file: str | Path) -> Path:
        """Write what an experiment found into a file with the suffix .zip.

        It has the best measured controller with its motion, the tuned simulator with its intervals, the verdict,
        samples, spec, provenance and the report. Missing folders are created.
        """
        return self._connection.save(file, f"/experiments/{segment(of)}/takehome", ("zip",))
