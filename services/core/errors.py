"""All errors of gaplab.

    GaplabError
    ├── InvalidSpec          a spec or request is invalid; has every violation with its place
    │   ├── CostUnconfirmed      the cost is above the limit, or a name unlikely, and not confirmed
    │   └── InvalidRobotFile     a robot file cannot be stored
    ├── NotFound             no such study, experiment or plug-in
    ├── Conflict             the current state forbids the request
    │   └── Changed              someone changed the object since it was read
    ├── ConditionMissing     a change without the condition `If-Match`
    ├── KeyReused            an idempotency key was used for another request
    ├── LimitReached         too much work is in progress
    ├── Unauthenticated      no token, or an invalid one
    ├── Forbidden            the role of the token does not permit the request
    ├── StoreUnavailable     the database is unreachable
    │   ├── StoreChanged         it was replaced, restored or migrated under the process
    │   └── StoreDamaged         its file is damaged
    ├── SupervisorUnavailable   the supervisor hangs, or ends again and again
    ├── InvalidArchive       a file is not an archive of gaplab, or is damaged or malicious
    ├── InvalidRobot         a URDF or MJCF has what a World has no place for, or what no rigid body has
    ├── Unsupported          the request needs another kind of database
    ├── ClusterUnusable      Ray is unreachable, or a node would compute other numbers
    │   └── RayGone              Ray died or stands still; only a new process gets another
    ├── PluginBroken         an external plug-in file is unusable, or a plug-in breaks its contract
    ├── PluginDiffers        a process has other versions of plug-ins than the supervisor
    ├── RealityFailed        the code of reality raised an error
    ├── RealityAwaited       reality is physical, and its answer is not there yet
    ├── TryAgain             a fault that may pass: the step is repeated after a pause
    └── EngineError
        ├── EngineUnavailable    the engine's library is not installed
        └── EngineInterrupted    the process died, or exceeded its time

Diverged physics is not an error: its fitness is nan, which never wins.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import islice
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gaplab.services.core.arrays import FloatArray


class GaplabError(Exception):
    """Base of all errors; the message is one sentence."""


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

    def __init__(self, violations: Iterable[Violation]) -> None:
        self.violations = tuple(islice(violations, 100))
        super().__init__("; ".join(f"{each.pointer or '/'}: {each.message}" for each in self.violations))


class InvalidRobotFile(InvalidSpec):
    """A robot file that cannot be stored, with all its violations."""


class CostUnconfirmed(InvalidSpec):
    """The cost is above the limit, or a name is unlikely, and the request does not confirm it."""


class NotFound(GaplabError):
    """No object has this name or id."""


class Conflict(GaplabError):
    """The current state forbids the request."""


class Changed(Conflict):
    """The object has changed since the client read it."""


class ConditionMissing(GaplabError):
    """A change lacks the condition `If-Match`."""


class KeyReused(GaplabError):
    """The idempotency key was used for another request."""


class LimitReached(GaplabError):
    """Too much work is in progress; the message names the limit.

    Attributes:
        retry_after_s: seconds after which to try again; None if unknown.
    """

    def __init__(self, message: str, retry_after_s: int | None = None) -> None:
        self.retry_after_s = retry_after_s
        super().__init__(message)


class Unauthenticated(GaplabError):
    """The request has no token, or an invalid one."""


class Forbidden(GaplabError):
    """The role of the token does not permit the request."""


class StoreUnavailable(GaplabError):
    """The database is not usable now."""


class StoreChanged(StoreUnavailable):
    """The database is no longer the one that the process knows, or has another schema; only a new process may go on."""


class StoreDamaged(StoreUnavailable):
    """The file of the database is damaged; the message says what to do."""


class SupervisorUnavailable(GaplabError):
    """Experiments do not run; the message says why."""


class InvalidArchive(GaplabError):
    """The file is not a valid archive; the message says where."""


class InvalidRobot(GaplabError):
    """A robot's URDF or MJCF cannot be imported, or tuned values cannot be written into it.

    Attributes:
        reasons: a sentence each.
    """

    def __init__(self, reasons: Iterable[str]) -> None:
        self.reasons = tuple(reasons)
        super().__init__("; ".join(self.reasons))


class Unsupported(GaplabError):
    """This kind of database does not support the request; the message names an alternative."""


class ClusterUnusable(GaplabError):
    """Ray is unreachable, or one of its nodes would compute other numbers or fail."""


class RayGone(ClusterUnusable):
    """The Ray of this process died or does not answer; calls to it may never return."""


class PluginBroken(GaplabError):
    """A plug-in file is unusable; the message says which, and why."""


class PluginDiffers(GaplabError):
    """A process has other versions of the external plug-ins that a spec names, or cannot use them.

    Args:
        differences: a sentence for each plug-in, by its kind and name.
        expected: the version of each that the supervisor has.
    """

    def __init__(self, differences: Mapping[str, str], expected: Mapping[str, str]) -> None:
        self.differences, self.expected = dict(differences), dict(expected)
        super().__init__(self.differences, self.expected)  # the arguments, so that it can be pickled

    def __str__(self) -> str:
        """Return the sentences."""
        return "; ".join(self.differences.values())


class RealityAwaited(GaplabError):
    """Reality is physical: the repetition waits for the measurement of a genome.

    Attributes:
        genome: `(g,)`.
    """

    def __init__(self, genome: "FloatArray") -> None:
        self.genome = genome
        super().__init__("a measurement of the physical robot is awaited")


class RealityFailed(GaplabError):
    """The code of reality raised the error that is this one's cause; its message may name hidden parameters."""


class TryAgain(GaplabError):
    """A plug-in raises it for a fault that may pass by itself, like a lost connection; the step is then repeated."""


class EngineError(GaplabError):
    """An engine failed."""


class EngineUnavailable(EngineError):
    """The library of an engine is not installed; the message says how to install it."""


class EngineInterrupted(EngineError):
    """The process that runs the physics ended before it answered."""


def unknown_name(pointer: str, kind: str, name: str, permitted: Sequence[str]) -> Violation:
    """Return the violation of an unknown name, with the nearest permitted one."""
    nearest = next(iter(get_close_matches(name, permitted, n=1, cutoff=0.5)), None)
    hint = f" (did you mean {nearest!r}?)" if nearest else ""
    message = f"unknown {kind} {name!r}{hint}; permitted: {', '.join(permitted)}"
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
