"""Replays of controllers."""

from gaplab.api.clients.connection import Connection, Of, segment
from gaplab.schemas.replays import Replay


class Replays:
    """Replays, which the service computes on request."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def replay(self, of: Of, /, **choice: int | str | None) -> Replay:
        """Return the motion of a controller of an experiment in its simulator and in reality.

        Its choice, as in the API: repetition, iteration (left out: the last that was measured), kind ("transfer" or
        "sample") and simulator.
        """
        return self._connection.get(Replay, f"/experiments/{segment(of)}/replay", **choice)
