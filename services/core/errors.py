"""Errors that several folders raise, and the base of all. An error of one folder is defined where it is raised.

Diverged physics is not an error: its fitness is nan, which never wins.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import islice
from typing import Any, ClassVar


class GaplabError(Exception):
    """Base of all errors; the message is one sentence.

    Attributes:
        kind: what the error is, for programs, like `not-found`; empty if no request should meet it.
        title: the same for people.
        retry_after_s: seconds after which to try again; None if unknown.
    """

    kind: ClassVar[str] = ""
    title: ClassVar[str] = ""
    retry_after_s: int | None = None


@dataclass(frozen=True)
class Violation:
    """One error in a spec.

    Attributes:
        pointer: JSON pointer of the offending value within the spec, like `/strategy/options/fit_weight`.
        value: the offending value, as given.
        message: one sentence.
        permitted: permitted values, as a list or a phrase.
        nearest: the permitted name nearest to a misspelt one.
    """

    pointer: str
    value: Any
    message: str
    permitted: Sequence[str] | str | None = None
    nearest: str | None = None

    def moved(self, prefix: str, to: str) -> "Violation":
        """Return the violation with another prefix of its pointer."""
        if not self.pointer.startswith(prefix):
            return self
        return replace(self, pointer=to + self.pointer.removeprefix(prefix))


class InvalidSpec(GaplabError):
    """A spec that cannot run, with its first hundred violations."""

    kind, title = "invalid-spec", "The spec is invalid"

    def __init__(self, violations: Iterable[Violation]) -> None:
        self.violations = tuple(islice(violations, 100))
        super().__init__("; ".join(f"{each.pointer or '/'}: {each.message}" for each in self.violations))


class NotFound(GaplabError):
    """No object has this name or id."""

    kind, title = "not-found", "Not found"


class Conflict(GaplabError):
    """The current state forbids the request."""

    kind, title = "conflict", "The present state forbids this"


class LimitReached(GaplabError):
    """Too much work is in progress; the message names the limit."""

    kind, title = "limit-reached", "A limit is reached"

    def __init__(self, message: str, retry_after_s: int | None = None) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(message)


class Forbidden(GaplabError):
    """The role of the token does not permit the request."""

    kind, title = "forbidden", "The token does not permit this"


class InvalidArchive(GaplabError):
    """The file is not a valid archive; the message says where."""

    kind, title = "invalid-archive", "The archive is invalid"


class InvalidRobot(GaplabError):
    """A robot's URDF or MJCF cannot be imported, or tuned values cannot be written into it.

    Attributes:
        reasons: a sentence each.
    """

    def __init__(self, reasons: Iterable[str]) -> None:
        self.reasons = tuple(reasons)
        super().__init__("; ".join(self.reasons))


class PluginBroken(GaplabError):
    """A plug-in file is unusable; the message says which, and why."""


class TryAgain(GaplabError):
    """A plug-in raises it for a fault that may pass by itself, like a lost connection; the step is then repeated."""


class EngineUnavailable(GaplabError):
    """The library of an engine is not installed; the message says how to install it."""

    kind, title = "engine-unavailable", "An engine is not installed here"


def unknown_name(pointer: str, kind: str, name: str, permitted: Sequence[str]) -> Violation:
    """Return the violation of an unknown name, with the nearest permitted one."""
    nearest = next(iter(get_close_matches(name, permitted, n=1, cutoff=0.5)), None)
    hint = f" (did you mean {nearest!r}?)" if nearest else ""
    message = f"unknown {kind} {name!r}{hint}; permitted: {', '.join(permitted) or 'none is known'}"
    return Violation(pointer, name, message, tuple(permitted), nearest)


def gather(*checks: Callable[[], Any]) -> tuple[Any, ...]:
    """Run all checks and return their results in order; if any fails, raise all violations together.

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
