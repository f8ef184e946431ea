"""Steps of a tuning, computed in this process, in its own thread: nothing runs beside what asks for them."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from time import monotonic

from rich.live import Live

from gaplab.api.clients.progress import cell, in_notebook
from gaplab.api.clients.screen import console
from gaplab.services.core.errors import Conflict
from gaplab.services.core.types import Step
from gaplab.services.running import execution, provenance
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Checkpoint, Claim, Delivered, Pulse, TimedStep
from gaplab.services.store.queries.checkpoints import kind_at
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import StepRecorder

OWNER = "gaplab.Tuning"
"""Owner of leases; a claim that an ended process left is handed back."""

EVERY_S = 2.0
"""Seconds between two checkpoints of a step: what an interruption loses at most, and how late a timeout may come."""


class _Ended(Exception):
    """What was asked for is computed; or the time is over, if its argument says so."""


def compute(store: Store, id_: str, last: type[Step] | None, until: float, *, progress: bool | None) -> None:
    """Compute the steps of the only experiment of a store, until reality is asked for, or all iterations have ended.

    Args:
        store: its steps, and checkpoints of the running one, are kept at once.
        id_: id of the experiment.
        last: the last kind of step to compute; None: all that can be.
        until: time of the monotonic clock at which it ends.
        progress: show long steps; None: in a terminal or a notebook.

    Raises:
        TimeoutError: the time is over; the next call goes on.
        Conflict: another process goes on with it, or other versions began it.
    """
    execution.hand_back_unheard(store, OWNER, ())
    claims = execution.claim(store, OWNER, 1)
    if not claims:
        found = provenance.read(store, id_)
        others = f"other versions began it: {found.computed_with}, not {found.refused_by}; client.accept_versions(id)"
        raise Conflict(others if found.refused_by else "another process goes on with it")
    (claim,) = claims
    try:
        with shown(progress) as show:
            emit = partial(_deliver, store, claim, last, until, show)
            StepRecorder(emit, EVERY_S, claim.log, claim.checkpoints).run(setting(claim.spec, claim.number))
        execution.complete(store, claim)
    except _Ended as ended:
        if ended.args:
            raise TimeoutError("it takes longer; what is computed is kept, and the next call goes on") from None
    finally:
        execution.hand_back(store, claim)


def _deliver(
    store: Store,
    claim: Claim,
    last: type[Step] | None,
    until: float,
    show: Callable[[str], object],
    item: Delivered | Pulse,
) -> None:
    """Keep what was computed, and end the computation if nothing else is to be computed now."""
    assert not isinstance(item, Pulse), "hardware has heartbeats, and this reality is a person's"
    held = execution.record_all(store, [(claim, [item])])
    if isinstance(item, TimedStep | Checkpoint) and not held:
        raise Conflict("another process goes on with it, so this one has ended its part")
    if isinstance(item, Checkpoint):
        show(f"{kind_at(item.step)[1]}: {item.rollouts:,} of {item.budget:,} rollouts")
    if isinstance(item, TimedStep) and last is not None and isinstance(item.step, last):
        raise _Ended
    if held and monotonic() > until:
        raise _Ended(until)


@contextmanager
def shown(progress: bool | None) -> Iterator[Callable[[str], object]]:
    """Yield a function that shows how far a computation is, in a line of text."""
    screen, notebook = console(stderr=True), in_notebook()
    if not (notebook or screen.is_terminal if progress is None else progress):
        yield lambda _: None
        return
    with ExitStack() as ends:
        live = None if notebook else ends.enter_context(Live(console=screen, auto_refresh=False, transient=True))
        place = cell() if live is None else partial(live.update, refresh=True)
        ends.callback(place, "")
        yield place
