"""What simulators answered in a step before it was interrupted: with it, the step is repeated without its physics.

A search depends on its random stream and on what it is told, so the answers that it was given are a whole checkpoint of
it, whichever strategy and optimizer it belongs to. They are kept by content: under a digest of the genome and the
simulators that were asked about. A checkpoint of anything else therefore has no answer, and never a wrong one.
"""

from collections.abc import Callable, Iterable, Iterator
from hashlib import blake2b
from itertools import groupby
from struct import Struct
from typing import TypeAlias

import numpy as np

from gaplab.services.core.arrays import Fitnesses, FloatArray, Genomes, Parameters
from gaplab.services.core.ports import Simulate

Answer: TypeAlias = tuple[Genomes, Parameters, Fitnesses]
"""`(n, g)`, `(m, p)` and the `(n, m)` that came of them."""

TOGETHER = 100
"""Simulators that a genome is asked for in at a time: the least that can be kept."""

_DIGEST_BYTES = 16
_HEADER = Struct("<II")
_FLOAT = np.dtype("<f8")


class Recall:
    """A Simulate that answers from before the interruption for as long as it can, and from then on asks.

    Args:
        simulate: is asked for what was not answered before.
        batch: rollouts that it likes to be asked for at a time, now.
        answers: as `pack` gives them, in any order and number.
    """

    def __init__(self, simulate: Simulate, batch: Callable[[], int], answers: Iterable[bytes] = ()) -> None:
        self._simulate = simulate
        self._batch = batch
        self._known = {key: row for packed in answers for key, row in unpack(packed)}

    def batch(self) -> int:
        """Rollouts to ask for at a time; 1 while answers are recalled, for only what is needed was kept for sure."""
        return 1 if self._known else self._batch()

    def forget(self) -> None:
        """The step is over: its answers are of no use any more."""
        self._known = {}

    def __call__(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        """`(n, g)` genomes × `(m, p)` parameters -> `(n, m)` fitnesses, as the Simulate that was given."""
        if len(parameters) <= TOGETHER:
            return self._recalled(genomes, parameters)
        starts = range(0, len(parameters), TOGETHER)
        return np.hstack([self._recalled(genomes, parameters[start : start + TOGETHER]) for start in starts])

    def _recalled(self, genomes: Genomes, parameters: Parameters) -> Fitnesses:
        if not self._known:
            return self._simulate(genomes, parameters)
        rows = [self._known.get(key) for key in _keys(genomes, parameters)]
        missing = [index for index, row in enumerate(rows) if row is None]
        if missing:  # everything that was needed before the interruption was answered: here it was interrupted
            self._known = {}
            for index, row in zip(missing, self._simulate(genomes[missing], parameters), strict=True):
                rows[index] = row
        return np.array(rows, dtype=np.float64)


def pack(answers: Iterable[Answer]) -> bytes:
    """The answers as bytes: 16 for each genome in each set of simulators, and 8 for each fitness."""
    rows = [
        row
        for genomes, parameters, fitnesses in answers
        for row in zip(_keys(genomes, parameters), fitnesses, strict=True)
    ]
    packed = []
    for width, group in groupby(rows, key=lambda row: len(row[1])):
        keys, values = zip(*group, strict=True)
        packed += [_HEADER.pack(len(keys), width), *keys, np.array(values).astype(_FLOAT).tobytes()]
    return b"".join(packed)


def unpack(packed: bytes) -> Iterator[tuple[bytes, FloatArray]]:
    """The digest of each genome with its simulators, and its `(m,)` fitnesses in them."""
    start = 0
    while start < len(packed):
        count, width = _HEADER.unpack_from(packed, start)
        keys = start + _HEADER.size
        values = keys + count * _DIGEST_BYTES
        start = values + count * width * _FLOAT.itemsize
        rows = np.frombuffer(packed, _FLOAT, count * width, values).astype(np.float64).reshape(count, width)
        for index, row in enumerate(rows):
            key = keys + index * _DIGEST_BYTES
            yield packed[key : key + _DIGEST_BYTES], row


def _keys(genomes: Genomes, parameters: Parameters) -> list[bytes]:
    simulators = blake2b(np.ascontiguousarray(parameters).tobytes(), digest_size=_DIGEST_BYTES)
    keys = []
    for genome in genomes:
        digest = simulators.copy()
        digest.update(genome.tobytes())
        keys.append(digest.digest())
    return keys
