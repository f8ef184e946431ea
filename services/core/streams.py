"""Random numbers by address: what a stream draws depends on where it is used, never on what was drawn before."""

from hashlib import sha256

from numpy.random import PCG64, Generator, SeedSequence


def stream(seed: int, *path: str | int) -> Generator:
    """The random generator at an address such as `(strategy, repetition, iteration, phase)`.

    Equal addresses give equal streams, in any order and on any machine; different addresses give independent ones.
    That makes a resumed repetition bit-equal to one that never stopped.

    Args:
        seed: the experiment's seed, below 2**64.
        path: names and non-negative numbers; a name counts by its SHA-256, so that it may be anything.
    """
    return Generator(PCG64(SeedSequence(seed, spawn_key=tuple(_word(part) for part in path))))


def _word(part: str | int) -> int:
    if isinstance(part, str):
        return int.from_bytes(sha256(part.encode()).digest()[:8], "big")
    return part
