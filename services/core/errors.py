"""Everything that gaplab refuses or fails at.

    GaplabError
    ├── InvalidSpec          what was asked for cannot be done; carries every violation with its place in the spec
    ├── NotFound             no such study, experiment or plug-in
    ├── Conflict             not now: the state forbids it
    │   └── Changed              somebody else changed it since it was looked at
    ├── ConditionMissing     a change that does not say which state it starts from
    ├── KeyReused            an idempotency key that stands for something else already
    ├── LimitReached         not now: too much is under way
    ├── Unauthenticated      no token, or one that admits nobody
    ├── Forbidden            the token's role does not permit it
    ├── StoreUnavailable     the database is unreachable, or its schema is not the one this version needs
    ├── InvalidArchive       a file that is no archive of ours, or one that was damaged or made to harm
    ├── Unsupported          another kind of database is needed for what was asked
    ├── ClusterUnusable      Ray is unreachable, or a node would compute other numbers
    └── EngineError
        ├── EngineUnavailable    the engine's library is not installed
        └── EngineInterrupted    its process died, or was ended for taking too long

Physics that blows up is no error: it is a fitness of nan, which never wins.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any


class GaplabError(Exception):
    """The root: its message is one readable sentence."""


@dataclass(frozen=True)
class Violation:
    """One thing wrong with a spec.

    Attributes:
        pointer: JSON pointer of the offending value within the spec, like `/strategy/options/fit_weight`.
        value: the offending value as it was given.
        message: one sentence that says what is wrong.
        permitted: what would have been right, where that can be listed or phrased.
        nearest: the permitted name that is most alike, for a misspelt name.
    """

    pointer: str
    value: Any
    message: str
    permitted: Sequence[str] | str | None = None
    nearest: str | None = None

    def moved(self, prefix: str, to: str) -> "Violation":
        """The same violation where what stood at `prefix` stands elsewhere."""
        if not self.pointer.startswith(prefix):
            return self
        return replace(self, pointer=to + self.pointer.removeprefix(prefix))


class InvalidSpec(GaplabError):
    """A spec that cannot be run, with everything that is wrong with it."""

    def __init__(self, violations: Iterable[Violation]) -> None:
        self.violations = tuple(violations)
        super().__init__("; ".join(f"{each.pointer or '/'}: {each.message}" for each in self.violations))


class NotFound(GaplabError):
    """There is nothing of that name or id."""


class Conflict(GaplabError):
    """The present state forbids what was asked."""


class Changed(Conflict):
    """It is not what it was when the sender of the change looked at it."""


class ConditionMissing(GaplabError):
    """A change does not say which state it starts from."""


class KeyReused(GaplabError):
    """An idempotency key stands for another request already."""


class LimitReached(GaplabError):
    """Too much is under way; the message names the limit.

    Attributes:
        retry_after_s: when it may be worth trying again; None where nobody knows.
    """

    def __init__(self, message: str, retry_after_s: int | None = None) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(message)


class Unauthenticated(GaplabError):
    """No token was shown, or one that admits nobody."""


class Forbidden(GaplabError):
    """The role of the token does not permit this."""


class StoreUnavailable(GaplabError):
    """The database cannot be used now."""


class InvalidArchive(GaplabError):
    """What was sent is no archive of experiments that can be read; the message says where it is wrong."""


class Unsupported(GaplabError):
    """This kind of database cannot do what was asked; the message says what can."""


class ClusterUnusable(GaplabError):
    """Ray is unreachable, or one of its nodes would compute other numbers, or none."""


class EngineError(GaplabError):
    """An engine cannot do its work."""


class EngineUnavailable(EngineError):
    """The library of an engine is not installed; the message says how to install it."""


class EngineInterrupted(EngineError):
    """Physics ended before it answered; nothing else did."""


def unknown_name(pointer: str, kind: str, name: str, permitted: Sequence[str]) -> Violation:
    """The violation of naming something that is not there, with the nearest name that is."""
    nearest = next(iter(get_close_matches(name, permitted, n=1, cutoff=0.5)), None)
    hint = f" (did you mean {nearest!r}?)" if nearest else ""
    message = f"there is no {kind} called {name!r}{hint}; there is {', '.join(permitted)}"
    return Violation(pointer, name, message, tuple(permitted), nearest)


def gather(*checks: Callable[[], Any]) -> tuple[Any, ...]:
    """What each check gives, in order; if any refuses, everything that all of them find wrong.

    Raises:
        InvalidSpec: with the violations of every check, each once.
    """
    results, violations = [], []
    for check in checks:
        try:
            results.append(check())
        except InvalidSpec as error:
            violations += [each for each in error.violations if each not in violations]
    if violations:
        raise InvalidSpec(violations)
    return tuple(results)
