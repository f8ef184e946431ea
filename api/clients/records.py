"""Studies and experiments: what the service stores of them, and requests that change their state or size."""

from collections.abc import Mapping
from typing import Any

from gaplab.api.clients.connection import CONFIRMED, Connection, Of, segment
from gaplab.schemas.keeping import Edit
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import AttemptRead, ExperimentRead, Page, RepetitionRead, StudyRead
from gaplab.schemas.spec import SpecRead


class Records:
    """Studies and experiments of a service. Those that change return the study after the change.

    Where a study is meant, the id of one of its experiments means that one alone, as a study of one.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def study(self, of: Of) -> StudyRead:
        """Return a study."""
        return self._connection.get(StudyRead, f"/studies/{segment(of)}")

    def experiment(self, of: Of, *, reveal: bool = False) -> ExperimentRead:
        """Return an experiment; `reveal`, which needs the token of an admin, shows reality's parameters early."""
        shown = {"reveal": "true"} if reveal else {}
        return self._connection.get(ExperimentRead, f"/experiments/{segment(of)}", **shown)

    def spec(self, of: Of) -> SpecRead:
        """Return the spec of a study: the shortest one that gives the same, and the complete ones."""
        return self._connection.get(SpecRead, f"/studies/{segment(of)}/spec")

    def studies(self, *, query: str | None = None, **filters: str | int | None) -> Page[StudyRead]:
        """Return a page of studies, newest first: `items`, and `next`, the cursor of the next page or None.

        Args:
            query: like `strategy = informative and fitness > 0.5`, or words; archived ones need `archived = true`.
            filters: as in the API: limit (50 if left out, 500 at most), cursor, state, strategy, text, sort.
        """
        return self._connection.get(Page[StudyRead], "/studies", q=query, **filters)

    def edit(self, of: Of, edit: Edit | Mapping[str, Any]) -> StudyRead:
        """Change the name, the notes or the tags of a study.

        Args:
            of: the study; or one of its experiments, whose name alone can change.
            edit: what changes, like `{"notes": "the floor was wet", "add_tags": ["wet"]}`; permitted: name, notes,
                tags, add_tags and remove_tags.
        """
        body = edit.model_dump(exclude_unset=True) if isinstance(edit, Edit) else edit
        headers = {"If-Match": "*"}
        return self._connection.change(StudyRead, "PATCH", f"/studies/{segment(of)}", json=body, headers=headers)

    def pause(self, of: Of) -> StudyRead:
        """Pause a study once its current steps end."""
        return self.apply(of, Verb.PAUSE)

    def resume(self, of: Of) -> StudyRead:
        """Continue a paused study."""
        return self.apply(of, Verb.RESUME)

    def stop(self, of: Of) -> StudyRead:
        """Complete a study with its results so far, once its current steps end."""
        return self.apply(of, Verb.STOP)

    def cancel(self, of: Of) -> StudyRead:
        """Cancel a study at once."""
        return self.apply(of, Verb.CANCEL)

    def retry(self, of: Of) -> StudyRead:
        """Queue the FAILED repetitions of a study once more, from their stored steps."""
        return self.apply(of, Verb.RETRY)

    def extend(
        self, of: Of, *, iterations: int | None = None, repetitions: int | None = None, yes: bool = False
    ) -> StudyRead:
        """Extend the completed experiments of a study that are smaller to these totals.

        A total that is left out stays. With `yes`, they are extended whatever it costs.
        """
        totals = {"iterations": iterations, "repetitions": repetitions}
        given = {name: total for name, total in totals.items() if total is not None}
        return self.apply(of, f"{Verb.EXTEND}{CONFIRMED if yes else ''}", given)

    def schedule(self, of: Of, **changes: int | None) -> StudyRead:
        """Change the `priority` or `max_parallel` of the experiments of a study."""
        return self._connection.change(StudyRead, "PATCH", f"/studies/{segment(of)}/schedule", json=changes)

    def accept_versions(self, of: Of) -> StudyRead:
        """Let experiments continue under other versions of engines or plug-ins than they started with."""
        return self.apply(of, "accept-versions")

    def apply(self, of: Of, verb: str, body: Mapping[str, int] | None = None) -> StudyRead:
        """Send a verb to a study."""
        return self._connection.change(StudyRead, "POST", f"/studies/{segment(of)}/{verb}", json=body)

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
