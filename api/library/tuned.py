"""What a tuning gives: controllers with their motions, and a tuned simulator with what is known about it."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from html import escape
from typing import Self

from pydantic import TypeAdapter

from gaplab.api.clients.driving import DriverMotion
from gaplab.schemas.misfit import MisfitRead, TunableVerdict
from gaplab.schemas.records import SimulatorRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.findings.wording import interval, number
from gaplab.services.measuring.motion_files import written


class Genome(tuple[float, ...]):
    """The numbers of a controller.

    Attributes:
        fitness: fitness in the tuned simulator; None if it was not evolved there, or the physics failed.
        expected: what the tuned simulators expect of it, a sentence each.
    """

    fitness: float | None
    expected: tuple[str, ...]
    _spec: ResolvedSpec

    @classmethod
    def of(
        cls, genes: Iterable[float], spec: ResolvedSpec, fitness: float | None, expected: Iterable[str] = ()
    ) -> Self:
        """Return the genome of a spec's robot."""
        found = cls(map(float, genes))
        found._spec, found.fitness, found.expected = spec, fitness, tuple(expected)
        return found

    @property
    def motion(self) -> DriverMotion:
        """Its commands, as drivers of a bench get them; a Conflict if they are not known in advance."""
        text = written(self._spec, frozen(self), "json")
        return TypeAdapter(DriverMotion).validate_python(json.loads(text))


@dataclass(frozen=True)
class TunedSimulator:
    """The best simulator, tuned on all that was told.

    Attributes:
        values: value of each tunable.
        intervals: 95 % interval of each; empty if the tuner gives none.
        error: error per sample over the samples tuned on, in `unit`; None if the physics failed on one.
        noise: error that noise and rough physics alone would leave; None if the noise is unknown.
        held_out_error: error per held-out sample; None without any.
        unit: unit of the errors.
        verdicts: which tunables the samples identify, in words, and what would help.
        remarks: what else there is to say, a sentence each; the first is about a model that is wrong.
    """

    values: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    error: float | None
    noise: float | None
    held_out_error: float | None
    unit: str
    verdicts: tuple[TunableVerdict, ...]
    remarks: tuple[str, ...]

    @classmethod
    def of(cls, best: SimulatorRead, misfit: MisfitRead) -> Self:
        """Return what is known about the best simulator of an experiment."""
        held_out, unit = misfit.points[-1].held_out_error.mean, misfit.error_unit
        errors = best.error, best.expected_error, held_out
        return cls(best.parameters, best.intervals or {}, *errors, unit, misfit.verdicts, misfit.remarks)

    def __repr__(self) -> str:
        return f"<simulator: {'; '.join(self._values())}; {self._errors()}>"

    def __str__(self) -> str:
        helps = (f"; helps: {', '.join(each.helps)}" if each.helps else "" for each in self.verdicts)
        said = (each.sentence + more for each, more in zip(self.verdicts, helps, strict=True))
        return "\n".join((*self._values(), self._errors(), *said, *self.remarks))

    def _repr_html_(self) -> str:
        judged = [each.verdict.value for each in self.verdicts] or [""] * len(self.values)
        rows = (f"<tr><td>{escape(each)}<td>{verdict}" for each, verdict in zip(self._values(), judged, strict=True))
        told = (f"<li>{escape(each)}" for each in (self._errors(), *self.remarks))
        return f"<table>{''.join(rows)}</table><ul>{''.join(told)}</ul>"

    def _values(self) -> Iterator[str]:
        for name, value in self.values.items():
            ends = self.intervals.get(name)
            yield f"{name} = {number(value, 4)}" + (f", {interval(*ends)}" if ends else "")

    def _errors(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        left = (
            "" if self.noise is None else f", of which noise and rough physics would leave {number(self.noise)}{unit}"
        )
        new = "" if self.held_out_error is None else f"; held-out error {number(self.held_out_error)}{unit}"
        return f"error {number(self.error)}{unit} a sample{left}{new}"
