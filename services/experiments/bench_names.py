"""Names of benches that are nearly those of others: a typing error would split one robot into two."""

from collections.abc import Sequence
from difflib import get_close_matches

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Violation
from gaplab.services.experiments.limits import Admission, CostUnconfirmed
from gaplab.services.store.queries.requests import bench_key, spellings
from gaplab.services.store.session import Session
from gaplab.services.world.robot_library import label_of

CLOSE = 0.8
"""Similarity of two names, from 0 to 1, from which one may be the other; names with other digits are others."""


def check_benches(session: Session, specs: Sequence[ResolvedSpec], admitted: Admission) -> None:
    """Refuse a bench that is new and nearly has the name of another, unless the request confirms it.

    Raises:
        CostUnconfirmed: the message has both names.
    """
    named = {each.reality.bench: None for each in specs if each.reality.bench not in (None, label_of(each.robot))}
    if not named or admitted.limits is None or admitted.cost_known:
        return
    known = {bench_key(each): each for each in spellings(session)}
    for bench in named:
        key = bench_key(bench)
        digits = list(filter(str.isdigit, key))
        alike = [each for each in known if list(filter(str.isdigit, each)) == digits]
        if key not in known and (close := get_close_matches(key, alike, n=1, cutoff=CLOSE)):
            message = (
                f"the bench {bench!r} is new, and {known[close[0]]!r} is known; if they are two robots, confirm it"
            )
            how = "confirm_cost=true, --yes, or yes=True in Python"
            raise CostUnconfirmed([Violation("confirm_cost", False, f"{message}: {how}", "true")])
