"""All errors of gaplab.

    GaplabError
    ├── InvalidSpec          the spec cannot be run; has every violation with its place in the spec
    ├── NotFound             no such study, experiment or plug-in
    ├── Conflict             the present state forbids the request
    │   └── Changed              the resource has changed since the sender read it
    ├── ConditionMissing     the change does not name the version that it starts from
    ├── KeyReused            the idempotency key belongs to another request
    ├── LimitReached         too much is under way; try again later
    ├── Unauthenticated      the token is missing or invalid
    ├── Forbidden            the role of the token does not permit the request
    ├── StoreUnavailable     the database is unreachable, or has another schema than this version needs
    ├── InvalidArchive       the file is damaged, harmful or not an archive
    ├── Unsupported          this kind of database cannot do it
    ├── ClusterUnusable      Ray is unreachable, or a node would compute other numbers
    ├── PluginBroken         an external plug-in cannot be used
    └── EngineError
        ├── EngineUnavailable    the engine's library is not installed
        └── EngineInterrupted    its process died, or took too long and was ended

Failed physics is not an error: its fitness is nan, which never wins.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any


class GaplabError(Exception):
    """The root of all errors; the message is one sentence."""


@dataclass(frozen=True)
class Violation:
    """One fault of a spec.

    Attributes:
        pointer: JSON pointer of the offending value within the spec, like `/strategy/options/fit_weight`.
        value: the offending value.
        message: one sentence that says what is wrong.
        permitted: the permitted values, as a list or in words; None if neither is possible.
        nearest: the most similar permitted name, for a misspelt name.
    """

    pointer: str
    value: Any
    message: str
    permitted: Sequence[str] | str | None = None
    nearest: str | None = None

    def moved(self, prefix: str, to: str) -> "Violation":
        """Return the violation with the pointer `prefix` replaced by `to`."""
        if not self.pointer.startswith(prefix):
            return self
        return replace(self, pointer=to + self.pointer.removeprefix(prefix))


class InvalidSpec(GaplabError):
    """The spec cannot be run; the error has every violation."""

    def __init__(self, violations: Iterable[Violation]) -> None:
        self.violations = tuple(violations)
        super().__init__("; ".join(f"{each.pointer or '/'}: {each.message}" for each in self.violations))


class NotFound(GaplabError):
    """Nothing has this name or id."""


class Conflict(GaplabError):
    """The present state forbids the request."""


class Changed(Conflict):
    """The resource has changed since the sender of the change read it."""


class ConditionMissing(GaplabError):
    """The change does not name the version that it starts from."""


class KeyReused(GaplabError):
    """The idempotency key belongs to another request."""


class LimitReached(GaplabError):
    """Too much is under way; the message names the limit.

    Attributes:
        retry_after_s: seconds after which another attempt may succeed; None if unknown.
    """

    def __init__(self, message: str, retry_after_s: int | None = None) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(message)


class Unauthenticated(GaplabError):
    """The token is missing or invalid."""


class Forbidden(GaplabError):
    """The role of the token does not permit the request."""


class StoreUnavailable(GaplabError):
    """The database cannot be used at the moment."""


class InvalidArchive(GaplabError):
    """The file is damaged, harmful or not an archive; the message says where."""


class Unsupported(GaplabError):
    """This kind of database cannot do it; the message names the alternative."""


class ClusterUnusable(GaplabError):
    """Ray is unreachable, or one of its nodes would compute other numbers or fail."""


class PluginBroken(GaplabError):
    """An external plug-in cannot be used; the message names the file and the reason."""


class EngineError(GaplabError):
    """An engine cannot simulate."""


class EngineUnavailable(EngineError):
    """The library of an engine is not installed; the message says how to install it."""


class EngineInterrupted(EngineError):
    """The process of a rollout ended before it answered; nothing else is affected."""


def unknown_name(pointer: str, kind: str, name: str, permitted: Sequence[str]) -> Violation:
    """Return the violation for an unknown name, with the most similar permitted one."""
    nearest = next(iter(get_close_matches(name, permitted, n=1, cutoff=0.5)), None)
    hint = f" (did you mean {nearest!r}?)" if nearest else ""
    message = f"there is no {kind} called {name!r}{hint}; there is {', '.join(permitted)}"
    return Violation(pointer, name, message, tuple(permitted), nearest)


def gather(*checks: Callable[[], Any]) -> tuple[Any, ...]:
    """Return the result of each check, in order, or raise the violations of all checks together.

    Raises:
        InvalidSpec: with every violation, each once.
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
