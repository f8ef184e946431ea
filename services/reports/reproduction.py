"""How to compute a study again: its spec, and the commands."""

import json
from collections.abc import Iterator
from typing import Any

from gaplab.schemas.spec import SpecRead
from gaplab.services.reports.blocks import Block, Code, Paragraph
from gaplab.services.reports.content import Facts
from gaplab.services.specs.shortening import shortest

ONE = "Save the spec below as spec.json and submit it: gaplab submit spec.json --watch"
EACH = "Save each spec below as a file and submit it: gaplab submit spec.json --watch"


def reproduction(facts: Facts) -> Iterator[Block]:
    """Yield what to do, in sentences, and the spec to submit; that of each experiment if no single spec gives all."""
    found = submitted(facts)
    yield Paragraph(ONE if found.spec else EACH)
    yield Paragraph(
        "The same spec and seed give the same numbers, to the last bit, with the engines of the provenance above."
    )
    yield Paragraph(f"Every number is in the archive that gaplab export {facts.id} writes.")
    for remark in found.remarks:
        yield Paragraph(f"{remark[0].upper()}{remark[1:]}.", note=True)
    if found.spec:
        yield Code(spec_text(found.spec))
        return
    for experiment, one in zip(facts.experiments, facts.judged, strict=True):
        yield Paragraph(f"{one.name}:")
        yield Code(spec_text(shortest(experiment.name, [experiment.spec]).spec))


def submitted(facts: Facts) -> SpecRead:
    """Return the spec to submit, without parameters of reality that are hidden yet."""
    return shortest(facts.name, [experiment.spec for experiment in facts.experiments])


def spec_text(spec: dict[str, Any] | None) -> str:
    """Return a spec as JSON to read."""
    return json.dumps(spec, indent=2, ensure_ascii=False)
