"""The violations of a physical reality that need its robot: limits of its motion, and samples from before."""

from collections.abc import Iterator

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.errors import Violation
from gaplab.services.core.measured_values import sample_violations
from gaplab.services.core.robots.base import Robot
from gaplab.services.specs.measured import lack_violations

_REMEDY = "give the readings of each value in `readings`"


def bench_violations(spec: ExperimentSpec, robot: Robot, discrepancy: Discrepancy) -> Iterator[Violation]:
    """Yield limits that nothing can check, a refusal without limits, and samples that cannot be, or teach nothing."""
    if spec.reality.kind != "physical":
        return
    yield from _limit_violations(spec, robot)
    for place, sample in enumerate(spec.reality.samples):
        found = list(sample_violations(sample, robot))
        lacks = lack_violations(discrepancy, robot.sensors, sample.values, sample.readings, _REMEDY)
        for violation in found or lacks:
            yield violation.moved("", f"/reality/samples/{place}")


def _limit_violations(spec: ExperimentSpec, robot: Robot) -> Iterator[Violation]:
    limits = spec.reality.limits
    if limits is not None and not robot.world.bodies:
        message = f"the {robot.label} has no body, so no simulator can forecast its motion"
        yield Violation("/reality/limits", limits.model_dump(mode="json"), message, "left out")
    if spec.reality.beyond == "refuse" and (limits is None or limits == type(limits)()):
        message = "nothing is refused without limits; give some in `reality.limits`"
        yield Violation("/reality/beyond", spec.reality.beyond, message, "warn, or limits")
