"""Studies and experiments, and what the service stores of them."""

from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.errors import if_found
from gaplab.schemas.editing import Edit
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import AttemptRead, ExperimentRead, Page, RepetitionRead, StudyRead
from gaplab.schemas.spec import SpecRead

Record: TypeAlias = ExperimentRead | StudyRead


def experiments_of(record: Record) -> tuple[ExperimentRead, ...]:
    """Return the experiments of a study, or the experiment itself."""
    return record.experiments if isinstance(record, StudyRead) else (record,)


def path_of(record: Record) -> str:
    """Return the path of a study or an experiment."""
    return f"/{'studies' if isinstance(record, StudyRead) else 'experiments'}/{segment(record.id)}"


def split(records: Iterable[Record]) -> dict[str, list[str] | None]:
    """Return the ids of studies and experiments as the parameters `study` and `experiment` of a request."""
    found: dict[str, list[str]] = {"study": [], "experiment": []}
    for record in records:
        found["study" if isinstance(record, StudyRead) else "experiment"].append(record.id)
    return {name: ids or None for name, ids in found.items()}


class Records:
    """Studies and experiments of a service."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def study(self, id: str) -> StudyRead:
        """Return a study."""
        return self._connection.get(StudyRead, f"/studies/{segment(id)}")

    def experiment(self, id: str) -> ExperimentRead:
        """Return an experiment."""
        return self._connection.get(ExperimentRead, f"/experiments/{segment(id)}")

    def find(self, id: str) -> ExperimentRead | StudyRead:
        """Return the study or the experiment with this id."""
        with if_found():
            return self.study(id)
        return self.experiment(id)

    def spec(self, id: str) -> SpecRead:
        """Return the spec of a study or an experiment: the shortest one that gives the same, and the complete one."""
        return self._connection.get(SpecRead, f"{path_of(self.find(id))}/spec")

    def studies(self, *, query: str | None = None, **filters: str | int | None) -> Page[StudyRead]:
        """Return a page of studies, newest first: `items`, and `next`, the cursor of the next page or None.

        Args:
            query: like `strategy = informative and fitness > 0.5`, or words; archived ones need `archived = true`.
            filters: as in the API: limit (50 if left out, 500 at most), cursor, state, strategy, text, sort.
        """
        return self._connection.get(Page[StudyRead], "/studies", q=query, **filters)

    def experiments(self, *, query: str | None = None, **filters: str | int | None) -> Page[ExperimentRead]:
        """Return a page of experiments, newest first; the query and the filters are those of `studies`, and study."""
        return self._connection.get(Page[ExperimentRead], "/experiments", q=query, **filters)

    def edit(self, id: str, edit: Edit | Mapping[str, Any]) -> ExperimentRead | StudyRead:
        """Change the name, the notes or the tags of a study or an experiment, and return it.

        Args:
            id: id of the study or the experiment.
            edit: what changes, like `{"notes": "the floor was wet", "add_tags": ["wet"]}`; permitted: name, notes,
                tags, add_tags and remove_tags.
        """
        return self.patch(id, edit.model_dump(exclude_unset=True) if isinstance(edit, Edit) else edit)

    def patch(self, id: str, body: Mapping[str, Any]) -> ExperimentRead | StudyRead:
        """Change fields of a study or an experiment, which the service validates, and return it."""
        record = self.find(id)
        headers = {"If-Match": "*"}
        return self._connection.change(type(record), "PATCH", path_of(record), json=body, headers=headers)

    def apply(self, id: str, verb: str, body: Mapping[str, int] | None = None, query: str = "") -> Record:
        """Send a verb to a study or an experiment, and return it."""
        record = self.find(id)
        return self._connection.change(type(record), "POST", f"{path_of(record)}/{verb}{query}", json=body)

    def reveal(self, id: str) -> ExperimentRead:
        """Return an experiment with reality's parameters, even before it ends; needs the token of an admin."""
        return self._connection.get(ExperimentRead, f"/experiments/{segment(id)}", reveal="true")

    def repetitions(self, id: str) -> tuple[RepetitionRead, ...]:
        """Return the repetitions of an experiment."""
        return self._connection.get(tuple[RepetitionRead, ...], f"/experiments/{segment(id)}/repetitions")

    def attempts(self, id: str, repetition: int) -> tuple[AttemptRead, ...]:
        """Return the attempts at a repetition of an experiment: supervisor, times and ending of each."""
        path = f"/experiments/{segment(id)}/repetitions/{repetition}/attempts"
        return self._connection.get(tuple[AttemptRead, ...], path)

    def provenance(self, id: str) -> ProvenanceRead:
        """Return the versions of everything that computed an experiment."""
        return self._connection.get(ProvenanceRead, f"/experiments/{segment(id)}/provenance")
