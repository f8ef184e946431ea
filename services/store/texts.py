"""Text to store: without characters that databases refuse, of limited length, and tags as one text."""

from collections.abc import Iterable

LONGEST_REASON = 2_000
"""Characters of a reason; lists of experiments have those of every failed repetition."""


def storable(text: str) -> str:
    """Return the text with NUL characters and lone surrogates replaced, which databases refuse."""
    return text.encode(errors="replace").decode().replace("\0", "\N{REPLACEMENT CHARACTER}")


def brief(text: str) -> str:
    """Return the text, or its beginning if it has more than `LONGEST_REASON` characters."""
    if len(text) <= LONGEST_REASON:
        return text
    return f"{text[: LONGEST_REASON - 100]}… (the beginning of {len(text):,} characters, which are in the log)"


def pack_tags(tags: Iterable[str]) -> str | None:
    """Return tags as one text, sorted, with a space before and after each; None for no tags."""
    return f" {' '.join(names)} " if (names := sorted({storable(tag) for tag in tags})) else None


def unpack_tags(text: str | None) -> tuple[str, ...]:
    """Return the tags in a text of `pack_tags`."""
    return tuple((text or "").split())
