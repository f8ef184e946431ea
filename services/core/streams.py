"""Random numbers by address: a stream depends on where it is used, not on earlier draws."""

from hashlib import sha256

from numpy.random import PCG64, Generator, SeedSequence


def stream(seed: int, *path: str | int) -> Generator:
    """Return the random generator at an address such as `(strategy, repetition, iteration, phase)`.

    Equal addresses give equal streams, in any order and on any machine; different addresses give independent ones.
    Therefore a resumed repetition is bit-equal to an uninterrupted one.

    Args:
        seed: the experiment's seed, below 2**64.
        path: names and non-negative numbers; any name is allowed, because its SHA-256 is used.
    """
    return Generator(PCG64(SeedSequence(seed, spawn_key=tuple(_word(part) for part in path))))


def _word(part: str | int) -> int:
    if isinstance(part, str):
        return int.from_bytes(sha256(part.encode()).digest()[:8], "big")
    return part
