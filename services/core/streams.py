"""Random numbers by address: a stream depends on the place of its use, not on earlier draws."""

from hashlib import sha256

from numpy.random import PCG64, Generator, SeedSequence


def stream(seed: int, *path: str | int) -> Generator:
    """Return the random generator at an address such as `(strategy, repetition, iteration, phase)`.

    Equal addresses give equal streams, in any order and on any machine; different addresses give independent ones.
    That makes a resumed repetition bit-equal to one that never stopped.

    Args:
        seed: the experiment's seed, below 2**64.
        path: names and non-negative numbers; of a name, the SHA-256 counts, so any string is permitted.
    """
    return Generator(PCG64(SeedSequence(seed, spawn_key=tuple(_word(part) for part in path))))


def _word(part: str | int) -> int:
    if isinstance(part, str):
        return int.from_bytes(sha256(part.encode()).digest()[:8], "big")
    return part
