"""The answers of simulators within one step: counted, prefetched, and recorded to continue an interrupted step.

A search depends only on its random stream and on the answers that it gets. So the answers are a complete checkpoint of
a step, for any strategy and optimizer. The key of an answer is a digest of its genome and its simulators, so a
checkpoint of another step never gives a wrong answer.

Answers are also prefetched. A steady-state search asks about one newcomer at a time, because the next one may descend
from it. But the search rejects most newcomers at once, and then the next one is known beforehand. Idle cores simulate
the next ones too. No number changes: a prefetched answer is used only if the search asks for it.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from hashlib import blake2b
from itertools import groupby
from math import ceil
from struct import Struct
from typing import Protocol, TypeAlias

import numpy as np

from gaplab.services.core.arrays import NO_READINGS, Fitnesses, FloatArray, Genomes, Outcomes, Parameters
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.ports import Sense, Simulate
from gaplab.services.core.types import Cost

Answer: TypeAlias = tuple[bytes, FloatArray]
"""The key of a genome in a block of m simulators, and its `(m,)` fitnesses there, or its `(m · (1 + q),)` outcomes."""

Following: TypeAlias = Callable[[int], Genomes]
"""A function that returns up to n genomes of the next questions, probably, `(≤ n, g)`."""

BLOCK = 100
"""Most simulators in one call. It is the smallest part of a question that a checkpoint can hold."""

_DIGEST_BYTES = 16
_SENSED = b"sensed"
"""Part of the keys of answers with readings, which are longer."""

_HEADER = Struct("<II")
_FLOAT = np.dtype("<f8")


class Recorder(Protocol):
    """Records new answers, for checkpoints."""

    def genomes_per_call(self, simulators: int) -> int:
        """Return how many genomes to simulate in the next call, in this number of simulators; at least 1."""
        ...

    def record(self, answers: Sequence[Answer], rollouts: int, budget: int) -> None:
        """Record the answers of that call, how many rollouts it had, and how many the step may have."""
        ...


def nothing(_: int) -> Genomes:
    """Return no genome, since the next questions are unknown."""
    return np.empty((0, 0))


class Answers:
    """A Simulate for one step, which counts rollouts, prefetches answers, and reads answers from checkpoints.

    Args:
        simulate: the simulation.
        batch_size: returns how many rollouts a call should ask for now to keep all cores busy.
        checkpoints: answers of this step from before an interruption, each as `pack` returns them.
        recorder: records what `simulate` and `sense` return.
        sense: the simulation with readings; None if there is none.
        periods: `(q,)`: period of each reading, over its noise; 0 if it has none.
    """

    def __init__(
        self,
        simulate: Simulate,
        batch_size: Callable[[], int] = lambda: 1,
        checkpoints: Iterable[bytes] = (),
        recorder: Recorder | None = None,
        sense: Sense | None = None,
        periods: FloatArray = NO_READINGS,
    ) -> None:
        self.periods = periods
        self.budget = 0  # rollouts that the step was given
        self._simulate = simulate
        self._with_readings = sense
        self._batch_size = batch_size
        self._recorder = recorder
        self._ahead = {key: row for packed in checkpoints for key, row in unpack(packed)}
        self._rollouts = self._failures = 0

    def __call__(self, genomes: Genomes, parameters: Parameters, following: Following = nothing) -> Fitnesses:
        """Return the `(n, m)` fitnesses of genomes `(n, g)` in simulators `(m, p)`; nan where the physics failed.

        Args:
            genomes: asked about now; only these count as rollouts.
            parameters: parameters of the simulators.
            following: returns the genomes of the next questions, probably, in the same simulators.
        """
        blocks = _blocks(parameters)
        keys = [_keys(genomes, block) for block in blocks]
        answers = self._ahead
        if not all(key in answers for column in keys for key in column):
            answers = self._fetched(genomes, blocks, keys, following)
        columns = [np.array([answers[key] for key in column]) for column in keys]
        if answers is not self._ahead:
            self._ahead = answers
            for key in (key for column in keys for key in column):
                answers.pop(key, None)
        fitnesses = columns[0] if len(columns) == 1 else np.hstack(columns)
        self._rollouts += fitnesses.size
        self._failures += int(np.isnan(fitnesses).sum())
        return fitnesses

    def sense(self, genomes: Genomes, parameters: Parameters) -> Outcomes:
        """Return fitness and readings `(n, m, 1 + q)` of genomes `(n, g)` in simulators `(m, p)`; nan where it failed.

        Raises:
            PluginBroken: the robot has no sensors.
        """
        if self._with_readings is None:
            raise PluginBroken("readings are asked for, and the robot has no sensors")
        outcomes = np.concatenate([self._sensed(genomes, block) for block in _blocks(parameters)], axis=1)
        self._rollouts += outcomes[:, :, 0].size
        self._failures += int(np.isnan(outcomes[:, :, 0]).sum())
        return outcomes

    @property
    def senses(self) -> bool:
        """Return whether the robot has sensors."""
        return self._with_readings is not None

    @property
    def cost(self) -> Cost:
        """Return the cost of the step so far."""
        return Cost(self._rollouts, self._failures, self.budget - self._rollouts)

    def cost_within_budget(self, source: str) -> Cost:
        """Return the cost of the step so far; `source` says whose budget it is, for the error.

        Raises:
            PluginBroken: the step took more rollouts.
        """
        if self.cost.saved < 0:
            raise PluginBroken(f"{source} took {self._rollouts} rollouts; permitted: at most {self.budget}")
        return self.cost

    def _fetched(
        self, genomes: Genomes, blocks: list[Parameters], keys: list[list[bytes]], following: Following
    ) -> dict[bytes, FloatArray]:
        """Return the answers about the genomes, and about as many of the following ones as idle cores can simulate."""
        room = ceil(self._batch_size() / sum(map(len, blocks))) - len(genomes)
        more = following(room) if room > 0 else genomes[:0]
        together = np.vstack([genomes, more]) if len(more) else genomes
        answers: dict[bytes, FloatArray] = {}
        for block, asked in zip(blocks, keys, strict=True):
            wanted = asked + _keys(more, block)
            answers.update((key, self._ahead[key]) for key in wanted if key in self._ahead)
            missing = [index for index, key in enumerate(wanted) if key not in answers]
            keys_of = [wanted[index] for index in missing]
            answers.update(self._computed(self._simulate, together[missing], block, keys_of))
        return answers

    def _sensed(self, genomes: Genomes, block: Parameters) -> Outcomes:
        keys = _keys(genomes, block, _SENSED)
        answers = {key: self._ahead.pop(key) for key in dict.fromkeys(keys) if key in self._ahead}
        missing = [index for index, key in enumerate(keys) if key not in answers]
        answers.update(self._computed(self._flat, genomes[missing], block, [keys[index] for index in missing]))
        return np.array([answers[key] for key in keys]).reshape(len(genomes), len(block), -1)

    def _flat(self, genomes: Genomes, parameters: Parameters) -> FloatArray:
        """Return the outcomes as one row for each genome, `(n, m · (1 + q))`."""
        assert self._with_readings is not None
        return self._with_readings(genomes, parameters).reshape(len(genomes), -1)

    def _computed(
        self, compute: Simulate, genomes: Genomes, parameters: Parameters, keys: list[bytes]
    ) -> Iterator[Answer]:
        done = 0
        while done < len(genomes):
            count = self._recorder.genomes_per_call(len(parameters)) if self._recorder else len(genomes)
            rows = compute(genomes[done : done + count], parameters)
            answers = list(zip(keys[done : done + count], rows, strict=True))
            if self._recorder:
                self._recorder.record(answers, len(rows) * len(parameters), self.budget)
            yield from answers
            done += count


def pack(answers: Iterable[Answer]) -> bytes:
    """Return simulated fitnesses as bytes, for a checkpoint.

    The digest of a genome and its simulators takes 16 bytes, a number 8, and a run of answers with as many numbers 8.
    """
    packed = []
    for width, group in groupby(answers, key=lambda answer: len(answer[1])):
        keys, rows = zip(*group, strict=True)
        packed += [_HEADER.pack(len(keys), width), *keys, np.array(rows).astype(_FLOAT).tobytes()]
    return b"".join(packed)


def unpack(packed: bytes) -> Iterator[Answer]:
    """Yield the answers that were packed, equal to the last bit."""
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


def _blocks(parameters: Parameters) -> list[Parameters]:
    return [parameters[start : start + BLOCK] for start in range(0, len(parameters), BLOCK)]


def _keys(genomes: Genomes, parameters: Parameters, kind: bytes = b"") -> list[bytes]:
    simulators = blake2b(np.ascontiguousarray(parameters).tobytes() + kind, digest_size=_DIGEST_BYTES)
    keys = []
    for genome in genomes:
        digest = simulators.copy()
        digest.update(genome.tobytes())
        keys.append(digest.digest())
    return keys
