"""The repetitions that a supervisor has claimed: it launches them, receives and stores steps, and ends them."""

import logging
from collections.abc import Callable, Collection
from contextlib import suppress
from threading import Event
from time import monotonic

from gaplab.services.core.errors import Conflict
from gaplab.services.experiments.lease_ends import Silences
from gaplab.services.running import execution
from gaplab.services.running.leases import STALE_AFTER_S
from gaplab.services.specs.blame import describe
from gaplab.services.specs.resolution import hardware_of
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.lease import Claim, Failure
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import CHECKPOINT_S
from gaplab.workers.permits import PERMIT_SHARE
from gaplab.workers.plugins import Plugins
from gaplab.workers.task import Patience, Run, Tasks

WAIT_S = 0.2
"""Longest wait for a delivery."""

LOOK_S = 0.5
"""Shortest interval between looks for queued work, besides the one when a repetition ends; each takes milliseconds."""

STOP_S = 5.0
"""Longest wait for a task to stop its hardware."""

log = logging.getLogger("gaplab.supervisor")


class Repetitions:
    """The claimed repetitions of one supervisor. All methods raise StoreUnavailable; no delivery is lost then.

    `tasks` computes them. After `lease_s` without a heartbeat, others may take the claims.
    """

    def __init__(
        self,
        store: Store,
        owner: str,
        tasks: Tasks,
        checkpoint_s: float = CHECKPOINT_S,
        patience: Patience | None = None,
        lease_s: float = STALE_AFTER_S,
    ) -> None:
        self.runs: list[Run] = []
        self._store = store
        self._owner = owner
        self._tasks, self._plugins = tasks, Plugins(tasks.versions)
        self._checkpoint_s = checkpoint_s
        self._patience = patience or Patience()
        self._lease_s = lease_s
        self._looked = -LOOK_S
        self._unsure = False
        self._renewed = -lease_s
        self._silences = Silences[int]()

    def launch(self, claim: Claim) -> Run:
        """Start to compute a claimed repetition."""
        task = self._tasks.start(claim, self._plugins.expected(claim.spec), self._checkpoint_s)
        return Run(claim, task, hardware=hardware_of(claim.spec) is not None)

    def heartbeat(self) -> None:
        """Renew the claims, stop the runs whose claim is no longer valid, and end those that hang."""
        begun = monotonic()
        held = execution.heartbeat(self._store, [run.claim for run in self.runs])
        self._renewed = begun
        self._drop_all_but(held)
        self._permit()
        for run in self.runs:
            if not run.over and (reason := run.overdue(self._patience)):
                run.cancel()
                run.failed = Failure(reason, of_reality=bool(run.pulse and run.pulse.measuring))

    def requeue_lost(self) -> None:
        """Queue the repetitions of silent supervisors again."""
        lost = execution.requeue_lost(self._store, stale_after_s=self._lease_s, silences=self._silences)
        if lost:
            log.warning("%d repetitions whose supervisor was lost are queued again", lost)

    def claim(self, capacity: Callable[[], int]) -> None:
        """Hand back repetitions that should not start now, and claim up to the capacity."""
        if monotonic() - self._looked < LOOK_S:
            return
        self._looked = monotonic()
        waiting = [run.claim for run in self.runs if not (run.begun or run.over)]
        present = self._plugins.under, self._plugins.refused()
        if given := set(execution.give_way(self._store, waiting, *present)):
            self._drop_all_but([run.claim for run in self.runs if run.claim not in given])
        if self._unsure:
            execution.hand_back_unheard(self._store, self._owner, [run.claim for run in self.runs])
        self._unsure = True
        claims = execution.claim(self._store, self._owner, capacity() - len(self.runs), *present)
        self._unsure = False
        for claim in claims:
            self.runs.append(self.launch(claim))
            log.info("continues from step %d", len(claim.log), extra=self.runs[-1].place)

    def receive(self) -> None:
        """Wait shortly for deliveries, and take the ready ones."""
        runs = [run for run in self.runs if not run.over]
        if not runs:
            Event().wait(WAIT_S)
            return
        ready = self._tasks.ready([run.task for run in runs], WAIT_S)
        for run in runs:
            if any(run.task is task for task in ready):
                run.receive()

    def store_received(self) -> None:
        """Record the received deliveries and measurements that began; stop the runs whose claim is no longer valid."""
        if filled := [run for run in self.runs if run.received]:
            self._record(filled)
        self._note_measuring()

    def _record(self, filled: list[Run]) -> None:
        try:
            held = execution.record_all(self._store, [(run.claim, run.received) for run in filled])
        except StoreUnavailable:
            raise
        except Exception:  # noqa: BLE001 - what one repetition delivered must not stop the others
            held = self._record_each(filled)
        for run in filled:
            run.received = []
        self._drop_all_but([*held, *(run.claim for run in self.runs if run not in filled)])

    def end(self) -> None:
        """Complete, fail or release the repetitions whose task is over."""
        over = [run for run in self.runs if run.over]
        if not over:
            return
        self._complete([run for run in over if run.ended and run.lost is None])
        for run in over:
            if run.refused is not None:
                self._plugins.hand_back(self._store, run.claim, run.refused)
            elif run.failed is not None:
                execution.fail(self._store, run.claim, run.failed)
                log.error("%s", run.failed.reason, extra=run.place)
            elif run.lost is not None:
                execution.release(self._store, run.claim, run.lost)
                log.warning("queued again: %s", run.lost, extra=run.place)
            else:
                log.info("completed", extra=run.place)
            self.runs.remove(run)
        self._looked = -LOOK_S  # cores are free: look for work at once

    def hand_back(self, runs: list[Run]) -> None:
        """Stop these runs, record their last deliveries, and return their leases; without the database, they expire."""
        runs = list(runs)
        self._stop(runs)
        self.runs = [run for run in self.runs if run not in runs]
        if filled := [run for run in runs if run.received]:
            with suppress(StoreUnavailable):  # then the next holder computes or measures them again
                self._record(filled)
        for run in runs:
            try:
                execution.hand_back(self._store, run.claim)
            except StoreUnavailable as error:
                log.warning("not handed back, so its lease must expire: %s", error, extra=run.place)
            else:
                log.info("handed back", extra=run.place)

    def _record_each(self, runs: list[Run]) -> tuple[Claim, ...]:
        """Record each run's deliveries separately, and give up the runs whose log refuses them."""
        held: list[Claim] = []
        for run in runs:
            try:
                held += execution.record_all(self._store, [(run.claim, run.received)])
            except StoreUnavailable:
                raise
            except Conflict as error:
                run.cancel()
                run.received, run.lost = [], f"what it delivered could not be stored: {error}"
                held.append(run.claim)
            except Exception as error:
                log.exception("what it delivered cannot be stored", extra=run.place)
                run.cancel()
                run.received, run.failed = [], Failure(f"what it delivered cannot be stored: {describe(error)}")
                held.append(run.claim)
        return tuple(held)

    def _note_measuring(self) -> None:
        """Store for each run, once per measurement, that it waits for reality; permit it if its claim is valid."""
        noted = [run for run in self.runs if run.pulse and run.pulse.measuring and run.pulse.step != run.measuring]
        if not noted:
            return
        held = execution.note_measuring(self._store, [run.claim for run in noted])
        for run in noted:
            if run.pulse and run.claim in held:
                run.measuring = run.pulse.step
        self._drop_all_but([*held, *(run.claim for run in self.runs if run not in noted)])

    def _permit(self, but: Collection[Run] = ()) -> None:
        """Let measurements whose beginning is stored move hardware, for a part of the lease; none of the runs `but`."""
        able = (run for run in self.runs if run.hardware and run not in but)
        keys = [(run.claim.id, run.claim.epoch, run.measuring) for run in able if run.measuring is not None]
        self._tasks.permit(keys, self._renewed + PERMIT_SHARE * self._lease_s)

    def _stop(self, runs: Collection[Run]) -> None:
        """End the tasks of these runs; one that may be moving hardware may stop it first."""
        self._permit(but=runs)
        for run in runs:
            if run.hardware and run.measuring is not None:
                run.wait_for_end(self._tasks, STOP_S)
            run.cancel()

    def _complete(self, runs: list[Run]) -> None:
        try:
            execution.complete(self._store, *(run.claim for run in runs))
        except Conflict:
            for run in runs:
                try:
                    execution.complete(self._store, run.claim)
                except Conflict as error:
                    run.lost = f"it ended too early: {error}"

    def _drop_all_but(self, held: list[Claim] | tuple[Claim, ...]) -> None:
        """Stop the runs whose claim is no longer valid: cancelled, paused, stopped, handed back, or taken over."""
        claims = set(held)
        dropped = [run for run in self.runs if run.claim not in claims]
        self._stop(dropped)
        for run in dropped:
            self.runs.remove(run)
            log.info("dropped: this supervisor no longer holds its lease", extra=run.place)
        if dropped:
            execution.free_hardware(self._store, [run.claim for run in dropped])
