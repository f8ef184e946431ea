"""How long holders of hardware were silent, by a clock that nobody sets."""

from collections.abc import Callable, Mapping
from datetime import datetime
from time import monotonic


class Silences:
    """The heartbeats that one supervisor has seen, and since when each has stayed the same.

    A time in the database says too little about hardware: if somebody sets the database's clock, every lease seems to
    have expired, and a second worker would move a robot that the first still moves. So a supervisor waits until a
    heartbeat has not changed for a whole lease of its own monotonic clock.

    Args:
        clock: returns seconds, and is never set.
    """

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._since: dict[int, tuple[datetime, float]] = {}

    def longer_than(self, seconds: float, beats: Mapping[int, datetime]) -> dict[int, datetime]:
        """Return the heartbeats that have stayed the same for longer than this.

        Args:
            seconds: of this process's clock.
            beats: time of the last heartbeat by repetition; repetitions that are missing are forgotten.
        """
        present = self._clock()
        unchanged = {id_: since for id_, since in self._since.items() if since[0] == beats.get(id_)}
        self._since = {id_: unchanged.get(id_, (beat, present)) for id_, beat in beats.items()}
        return {id_: beat for id_, (beat, since) in self._since.items() if present - since > seconds}
