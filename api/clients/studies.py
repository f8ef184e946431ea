"""Studies and experiments: submitted, read, edited, changed in state or size, and kept."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from gaplab.api.clients.confirmation import can_ask, confirm
from gaplab.api.clients.connection import CONFIRMED, Connected, Of, segment
from gaplab.api.clients.objects import Experiment, Study
from gaplab.schemas.editing import DeletionRead, Edit, Order, ViewRead
from gaplab.schemas.estimates import EstimateRead
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.notifications import WebhookRead
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import AttemptRead, Page, RepetitionRead
from gaplab.schemas.sensitivity import SensitivityRead, SensitivitySpec
from gaplab.schemas.spec import ExperimentSpec, SpecRead, StudySpec

Spec = ExperimentSpec | StudySpec | Mapping[str, Any]

NOT_CHECKED = {"name", "strategy", "strategies", "direct_repetitions", "priority", "max_parallel"}
"""Fields of a spec that a sensitivity check does not have."""


class Studies(Connected):
    """Studies and experiments of a service. Methods that change one return the study after the change.

    Where a study is meant, the id of one of its experiments means that one alone, as a study of one.
    """

    def submit(self, spec: Spec, *, yes: bool = False) -> Study:
        """Queue a study; a spec that names a `strategy`, and no `strategies`, makes a study of one experiment.

        In a terminal or a notebook, the estimated cost is shown first, and above an hour a person is asked. With `yes`,
        it is submitted without estimate and question, whatever it costs.

        Raises:
            NotSubmitted: the person declined.
        """
        return self.send(spec, confirm_cost=yes or (can_ask() and confirm(self.estimate(spec), input)))

    def send(self, spec: Spec, *, confirm_cost: bool = False) -> Study:
        """Submit without estimate and question; the service refuses a high cost unless it is confirmed."""
        return self._connection.post(Study, f"/studies{CONFIRMED if confirm_cost else ''}", _body(spec))

    def estimate(self, spec: Spec) -> EstimateRead:
        """Return the rollouts, the duration and the resolved specs of a study; nothing is stored."""
        return self._connection.post(EstimateRead, "/studies/estimate", _body(spec))

    def check(self, spec: Spec | SensitivitySpec, *, every_s: float = 0.5) -> SensitivityRead:
        """Return the effect of the tunables of a spec on fitness; the service computes it if it is not known yet.

        The spec is one of an experiment, a study or a check, which is asked for every `every_s` seconds until it ends.
        """
        body = {name: value for name, value in _body(spec).items() if name not in NOT_CHECKED}
        check = self._connection.post(SensitivityRead, "/sensitivity", body)
        while not check.state.ended:
            time.sleep(every_s)
            check = self._connection.get(SensitivityRead, f"/sensitivity/{segment(check.id)}")
        return check

    def study(self, of: Of) -> Study:
        """Return a study."""
        return self._connection.get(Study, f"/studies/{segment(of)}")

    def experiment(self, of: Of, *, reveal: bool = False) -> Experiment:
        """Return an experiment; `reveal`, which needs the token of an admin, shows reality's parameters early."""
        shown = {"reveal": "true"} if reveal else {}
        return self._connection.get(Experiment, f"/experiments/{segment(of)}", **shown)

    def spec(self, of: Of) -> SpecRead:
        """Return the spec of a study, as it was submitted, to submit it again; and the complete ones."""
        return self._connection.get(SpecRead, f"/studies/{segment(of)}/spec")

    def studies(self, *, query: str | None = None, **filters: str | int | None) -> Page[Study]:
        """Return a page of studies, newest first: `items`, and `next`, the cursor of the next page or None.

        Args:
            query: like `strategy = informative and fitness > 0.5`, or words; archived ones need `archived = true`.
            filters: as in the API: limit (50 if left out, 500 at most), cursor, state, strategy, text, sort.
        """
        return self._connection.get(Page[Study], "/studies", q=query, **filters)

    def edit(self, of: Of, edit: Edit | Mapping[str, Any]) -> Study:
        """Change the name, the notes or the tags of a study.

        Args:
            of: the study; or one of its experiments, whose name alone can change.
            edit: what changes, like `{"notes": "the floor was wet", "add_tags": ["wet"]}`; permitted: name, notes,
                tags, add_tags and remove_tags.
        """
        body = edit.model_dump(exclude_unset=True) if isinstance(edit, Edit) else edit
        headers = {"If-Match": "*"}
        return self._connection.change(Study, "PATCH", f"/studies/{segment(of)}", json=body, headers=headers)

    def pause(self, of: Of) -> Study:
        """Pause a study once its current steps end."""
        return self._apply(of, Verb.PAUSE)

    def resume(self, of: Of) -> Study:
        """Continue a paused study."""
        return self._apply(of, Verb.RESUME)

    def stop(self, of: Of) -> Study:
        """Complete a study with its results so far, once its current steps end."""
        return self._apply(of, Verb.STOP)

    def cancel(self, of: Of) -> Study:
        """Cancel a study at once."""
        return self._apply(of, Verb.CANCEL)

    def retry(self, of: Of) -> Study:
        """Queue the FAILED repetitions of a study once more, from their stored steps."""
        return self._apply(of, Verb.RETRY)

    def extend(
        self, of: Of, *, iterations: int | None = None, repetitions: int | None = None, yes: bool = False
    ) -> Study:
        """Extend the completed experiments of a study that are smaller to these totals.

        A total that is left out stays. With `yes`, they are extended whatever it costs.
        """
        totals = {"iterations": iterations, "repetitions": repetitions}
        given = {name: total for name, total in totals.items() if total is not None}
        return self._apply(of, f"{Verb.EXTEND}{CONFIRMED if yes else ''}", given)

    def schedule(self, of: Of, **changes: int | None) -> Study:
        """Change the `priority` or `max_parallel` of the experiments of a study."""
        return self._connection.change(Study, "PATCH", f"/studies/{segment(of)}/schedule", json=changes)

    def accept_versions(self, of: Of) -> Study:
        """Let experiments continue under other versions of engines or plug-ins than they started with."""
        return self._apply(of, "accept-versions")

    def _apply(self, of: Of, verb: str, body: Mapping[str, int] | None = None) -> Study:
        """Send a verb to a study."""
        return self._connection.change(Study, "POST", f"/studies/{segment(of)}/{verb}", json=body)

    def repetitions(self, of: Of) -> tuple[RepetitionRead, ...]:
        """Return the repetitions of an experiment."""
        return self._connection.get(tuple[RepetitionRead, ...], f"/experiments/{segment(of)}/repetitions")

    def attempts(self, of: Of, repetition: int) -> tuple[AttemptRead, ...]:
        """Return the attempts at a repetition of an experiment: supervisor, times and ending of each."""
        path = f"/experiments/{segment(of)}/repetitions/{repetition}/attempts"
        return self._connection.get(tuple[AttemptRead, ...], path)

    def provenance(self, of: Of) -> ProvenanceRead:
        """Return the versions of everything that computed an experiment."""
        return self._connection.get(ProvenanceRead, f"/experiments/{segment(of)}/provenance")

    def tag(self, of: Of, *tags: str) -> Study:
        """Add tags to a study, and return it."""
        return self.edit(of, {"add_tags": _given(tags)})

    def untag(self, of: Of, *tags: str) -> Study:
        """Remove tags from a study, and return it."""
        return self.edit(of, {"remove_tags": _given(tags)})

    def archive(self, of: Of) -> Study:
        """Leave a study that has ended out of lists, and return it."""
        return self._apply(of, "archive")

    def unarchive(self, of: Of) -> Study:
        """List an archived study again, and return it."""
        return self._apply(of, "unarchive")

    def delete(self, of: Of) -> DeletionRead:
        """Delete a study that has ended, or one experiment of it, for good; twice is the same as once."""
        return self._connection.change(DeletionRead, "DELETE", f"/studies/{segment(of)}")

    def notify(self, of: Of, url: str | None) -> WebhookRead:
        """Tell a webhook when a study has ended; None tells none any more."""
        path = f"/studies/{segment(of)}/webhook"
        if url is None:
            return self._connection.change(WebhookRead, "DELETE", path)
        return self._connection.change(WebhookRead, "PUT", path, json={"url": url})

    def views(self) -> tuple[ViewRead, ...]:
        """Return the saved views, by name."""
        return self._connection.get(tuple[ViewRead, ...], "/views")

    def view(self, name: str) -> ViewRead:
        """Return a saved view."""
        return self._connection.get(ViewRead, _view(name))

    def save_view(self, name: str, query: str | None = None, *, sort: Order = "-created_at") -> ViewRead:
        """Save a query under a name that all users of the service share, in place of the view that has it."""
        body = {"query": query, "sort": sort}
        return self._connection.change(ViewRead, "PUT", _view(name), json=body)

    def delete_view(self, name: str) -> ViewRead:
        """Delete a saved view, and return it."""
        return self._connection.change(ViewRead, "DELETE", _view(name))


def _body(spec: BaseModel | Mapping[str, Any]) -> dict[str, Any]:
    """Return a spec as JSON.

    Raises:
        TypeError: it is neither a mapping nor a model, like the name of a file.
    """
    if isinstance(spec, BaseModel):
        return spec.model_dump(mode="json", exclude_unset=True)
    if not isinstance(spec, Mapping):
        hint = "; read a file with json.loads(Path(…).read_text())" if isinstance(spec, str | Path) else ""
        raise TypeError(f"a spec is a dict, an ExperimentSpec or a StudySpec, not {spec!r:.100}{hint}")
    return dict(spec)


def _view(name: str) -> str:
    return f"/views/{segment(name)}"


def _given(tags: tuple[str, ...]) -> tuple[str, ...]:
    if not tags:
        raise ValueError("give at least one tag")
    return tags
