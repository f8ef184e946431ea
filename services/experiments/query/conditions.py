"""SQL conditions of queries, for lists of experiments and of studies."""

from collections.abc import Callable, Mapping, Sequence

from sqlalchemy import ColumnElement, and_, case, not_, or_, select

from gaplab.schemas.lifecycle import OPEN, State
from gaplab.services.core.robot_library import IMPORTED
from gaplab.services.experiments.query import fields
from gaplab.services.experiments.query.fields import Condition, Field, field_of
from gaplab.services.experiments.query.parsing import Every, Not, Some, Term, Tree, Value, Words, inside, parse, refusal
from gaplab.services.store.cursor import Column
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.results import best_of_all, points_of_all
from gaplab.services.store.texts import storable

Fields = Mapping[str, Field]

_E, _S = ExperimentRow, StudyRow

_NEGATED = {"!=": "=", "!~": "~", "not in": "in"}
_ARCHIVED = "archived"


def of_study(condition: Condition) -> Condition:
    """SQL condition: the study has an experiment that meets the condition."""
    return select(_E.id).where(_E.study_id == _S.id, condition).exists()


def study_is(state: State) -> Condition:
    """SQL condition: the study is in the state; `views.state_of` computes the same for one study."""
    open_ = of_study(_E.state.in_(OPEN))
    if state is State.RUNNING:
        return and_(open_, *(not_(_all_left_are(each)) for each in OPEN if each is not State.RUNNING))
    if not state.ended:
        return and_(open_, _all_left_are(state))
    ends = (State.COMPLETED, State.FAILED, State.CANCELLED)
    before = (not_(of_study(_E.state == each)) for each in ends[: ends.index(state)])
    return and_(not_(open_), of_study(_E.state == state), *before)


def contains(text: str, *columns: Column) -> Condition:
    """SQL condition: a column contains the text; SQLite ignores the case of ASCII letters only."""
    wanted = storable(text)
    return or_(*(and_(column.is_not(None), column.icontains(wanted, autoescape=True)) for column in columns))


def _all_left_are(state: State) -> Condition:
    """SQL condition: no open experiment is in another state; for QUEUED, no experiment at all is."""
    others = State if state is State.QUEUED else OPEN
    return not_(of_study(_E.state.in_([each for each in others if each is not state])))


def _tagged(condition: Callable[[Column], Condition]) -> Condition:
    """SQL condition: the tags of the experiment, or of its study, meet the condition."""
    of_its_study = _E.study_id.in_(select(_S.id).where(condition(_S.tags)))
    return or_(condition(_E.tags), and_(_E.study_id.is_not(None), of_its_study))


def _of_some(field: Field) -> Field:
    """Return the field of studies that asks for an experiment with this field."""
    return Field(
        f"{field.meaning}; of one of its experiments", field.operators, lambda *asked: of_study(field.meets(*asked))
    )


def _either(first: Field, second: Field) -> Field:
    return Field(first.meaning, first.operators, lambda *asked: or_(first.meets(*asked), second.meets(*asked)))


def _name(field: str) -> ColumnElement[str]:
    """SQL: the name of a plug-in of the spec; NULL for none."""
    name: ColumnElement[str] = _E.spec[field]["name"].as_string()
    return name


def _of_robots() -> ColumnElement[str]:
    """SQL: the name that people know the robot by."""
    plugin, name = (_E.spec["robot"][place] for place in ("name", "options"))
    return case((plugin.as_string() == IMPORTED, name["name"].as_string()), else_=plugin.as_string())


EXPERIMENT_FIELDS: Fields = {
    "id": fields.text(_E.id, "id"),
    "name": fields.text(_E.name, "name"),
    "note": fields.text(_E.notes, "notes"),
    "tag": fields.tags(_tagged, "a tag of it or of its study"),
    "study": fields.text(_E.study_id, "id of its study; `none` without one"),
    "strategy": fields.text(_E.strategy, "name of the strategy"),
    "robot": fields.text(_of_robots(), "name of the robot"),
    "controller": fields.text(_name("controller"), "controller; `none`: the robot's own"),
    "task": fields.text(_name("task"), "task; `none`: the robot's own"),
    "engine": fields.text(_name("engine"), "engine of the simulators"),
    "reality": fields.text(_E.spec["reality"]["engine"]["name"].as_string(), "engine that is its reality"),
    "optimizer": fields.text(_name("optimizer"), "name of the optimizer"),
    "controller_optimizer": fields.text(_name("controller_optimizer"), "name of the optimizer of controllers"),
    "tuner": fields.text(_name("tuner"), "name of the tuner"),
    "discrepancy": fields.text(_name("discrepancy"), "name of the discrepancy that tuning minimises"),
    "state": fields.state(lambda state: _E.state == state, "state"),
    "fitness": fields.fitness(_E.id, *points_of_all(), "fitness after the last common number of evaluations"),
    "best_fitness": fields.fitness(_E.id, *best_of_all(), "best recorded fitness, averaged over repetitions"),
    "iterations": fields.whole(_E.spec["iterations"].as_integer(), "iterations of a repetition"),
    "repetitions": fields.whole(_E.spec["repetitions"].as_integer(), "repetitions"),
    "priority": fields.whole(-_E.precedence, "priority"),
    "created": fields.moment(_E.created_at, "time of its submission"),
    "started": fields.moment(_E.started_at, "time of its start"),
    "ended": fields.moment(_E.ended_at, "time of its end"),
    _ARCHIVED: fields.flag(_E.archived_at.is_not(None), "whether it is archived"),
}
"""The fields of experiments."""

_OWN = ("id", "name", "note", "tag", "study", "state", "created", _ARCHIVED)

STUDY_FIELDS: Fields = {
    "id": fields.text(_S.id, "id"),
    "name": fields.text(_S.name, "name"),
    "study": fields.text(_S.id, "id"),
    "note": _either(fields.text(_S.notes, "notes, also of its experiments"), _of_some(fields.text(_E.notes, ""))),
    "tag": fields.tags(lambda has: or_(has(_S.tags), of_study(has(_E.tags))), "a tag of it or of its experiments"),
    "state": fields.state(study_is, "state"),
    **{name: _of_some(field) for name, field in EXPERIMENT_FIELDS.items() if name not in _OWN},
    "created": fields.moment(_S.created_at, "time of its submission"),
    _ARCHIVED: fields.flag(_S.archived_at.is_not(None), "whether it is archived"),
}
"""The fields of studies: all fields of experiments, so that one query can search for both."""

EXPERIMENT_TEXTS = (_E.name, _E.id, _E.notes, _E.tags)
STUDY_TEXTS = (_S.name, _S.id, _S.notes, _S.tags)
"""Columns in which words are searched for."""


def experiments_meeting(query: str | None, *, all_: bool = False) -> list[Condition]:
    """Return the SQL conditions of a query on experiments; archived ones only if it asks for them, or all are wanted.

    Raises:
        InvalidSpec: the query is invalid; the message has the place.
    """
    return _meeting(query, EXPERIMENT_FIELDS, EXPERIMENT_TEXTS, [] if all_ else [_E.archived_at.is_(None)])


def studies_meeting(query: str | None) -> list[Condition]:
    """Return the SQL conditions of a query on studies, as `experiments_meeting` does."""
    return _meeting(query, STUDY_FIELDS, STUDY_TEXTS, [_S.archived_at.is_(None)])


def _meeting(query: str | None, known: Fields, texts: Sequence[Column], otherwise: list[Condition]) -> list[Condition]:
    tree = parse(query or "")
    if tree is None:
        return otherwise
    condition = _condition(tree, known, texts)
    return [condition] if _mentions(tree, _ARCHIVED) else [condition, *otherwise]


def _condition(tree: Tree, known: Fields, texts: Sequence[Column]) -> ColumnElement[bool]:
    match tree:
        case Words(value):
            return contains(value.text, *texts)
        case Term():
            return _compared(tree, known)
        case Not(part):
            return not_(_condition(part, known, texts))
        case Every(parts):
            return and_(*(_condition(part, known, texts) for part in parts))
        case Some(parts):
            return or_(*(_condition(part, known, texts) for part in parts))


def _compared(tree: Term, known: Fields) -> ColumnElement[bool]:
    field = field_of(known, tree.field)
    operator = _NEGATED.get(tree.operator, tree.operator)
    single = "=" if operator == "in" else operator
    if single not in field.operators:
        permitted = _permitted(field)
        message = f"{tree.field.text!r} has no operator {tree.operator}; permitted: {', '.join(permitted)}"
        raise refusal(Value(tree.operator, tree.field.place), message, permitted)
    met = or_(*(field.meets(single, value) for value in tree.values))
    return not_(met) if tree.operator in _NEGATED else met


def _permitted(field: Field) -> list[str]:
    negated = {meant: written for written, meant in _NEGATED.items()}
    both = [each for operator in field.operators for each in (operator, negated.get(operator)) if each]
    return [*both, "in", "not in"]


def _mentions(tree: Tree, name: str) -> bool:
    named = isinstance(tree, Term) and tree.field.text.lower() == name
    return named or any(_mentions(part, name) for part in inside(tree))
