"""Checks of measured values against the robot and the spec; all violations are raised together."""

from collections.abc import Iterator, Sequence

from gaplab.schemas.measurements import Table
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.measured_values import readings_violations, unit_violations
from gaplab.services.core.robot_library import label_of
from gaplab.services.core.stored_specs import discrepancy_of
from gaplab.services.specs.measured import lack_violations
from gaplab.services.specs.robots import robot_of
from gaplab.services.store.queries import attachments
from gaplab.services.store.session import Session

_REMEDY = "let the driver return (fitness, readings), or use `gaplab traces REQUEST FILE --answer`"


def check_values(
    spec: ResolvedSpec,
    values: Sequence[float] | None,
    readings: Sequence[Table] | None,
    unit: str | None,
) -> None:
    """Refuse values of another unit or number than the experiment asks for, and readings of another shape.

    If the experiment tunes on readings, values without any that it compares are refused too. An answer about a probe
    is no exception, since it also counts for a later sample of the same controller.

    Raises:
        InvalidSpec: with every violation.
    """
    robot = robot_of(spec)
    violations = list(_violations(spec, values, unit, robot.unit))
    if readings is not None:
        violations += readings_violations(readings, None if values is None else len(values), robot.sensors)
    if values is not None and not violations:
        discrepancy = discrepancy_of(spec.model_dump(include={"discrepancy"}))
        violations += lack_violations(discrepancy, robot.sensors, values, readings, _REMEDY)
    if violations:
        raise InvalidSpec(violations)


def check_attachments(session: Session, hashes: Sequence[str]) -> None:
    """Refuse attachments that are not stored.

    Raises:
        InvalidSpec: with each that is missing.
    """
    if missing := attachments.missing(session, hashes, "/attachments"):
        raise InvalidSpec(missing)


def _violations(spec: ResolvedSpec, values: Sequence[float] | None, unit: str | None, own: str) -> Iterator[Violation]:
    yield from unit_violations(label_of(spec.robot), unit, own)
    if values is not None and len(values) != spec.reality.repeats:
        wanted = spec.reality.repeats
        message = f"the experiment asks for {wanted} value{'' if wanted == 1 else 's'} a measurement, not {len(values)}"
        yield Violation("/values", list(values), message, f"exactly {wanted}")
