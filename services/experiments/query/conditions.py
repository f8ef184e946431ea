"""SQL conditions of queries on studies and their experiments.

Conditions on experiments that `and` and `or` join ask for one experiment that meets all of them together. Negated ones
ask for a study of which no experiment meets them.
"""

from collections.abc import Mapping

from sqlalchemy import ColumnElement, and_, case, not_, or_, select

from gaplab.schemas.lifecycle import OPEN, State
from gaplab.services.experiments.query import fields
from gaplab.services.experiments.query.fields import Condition, Field, field_of
from gaplab.services.experiments.query.parsing import Every, Not, Some, Term, Tree, Value, Words, inside, parse, refusal
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.results import best_of_all, points_of_all
from gaplab.services.store.texts import storable
from gaplab.services.world.robot_library import IMPORTED

Fields = Mapping[str, Field]

_E, _S = ExperimentRow, StudyRow

_NEGATED = {"!=": "=", "!~": "~", "not in": "in"}
_ARCHIVED = "archived"


def of_one(condition: Condition) -> Condition:
    """SQL condition: an experiment of the study meets the condition."""
    return select(_E.id).where(_E.study_id == _S.id, condition).exists()


def study_is(state: State) -> Condition:
    """SQL condition: the study is in the state; `views.state_of` computes the same for one study."""
    open_ = _S.id.in_(select(_E.study_id).where(_E.state.in_(OPEN)))
    if state is State.RUNNING:
        return and_(open_, *(not_(_all_left_are(each)) for each in OPEN if each is not State.RUNNING))
    if not state.ended:
        return and_(open_, _all_left_are(state))
    ends = (State.COMPLETED, State.FAILED, State.CANCELLED)
    before = (not_(of_one(_E.state == each)) for each in ends[: ends.index(state)])
    return and_(not_(open_), of_one(_E.state == state), *before)


def containing(text: str) -> Condition:
    """SQL condition: a text of the study, or an id of its experiments, contains this one.

    SQLite ignores the case of ASCII letters only.
    """
    wanted = storable(text)
    found = (and_(each.is_not(None), each.icontains(wanted, autoescape=True)) for each in _TEXTS)
    return or_(*found, of_one(_E.id.icontains(wanted, autoescape=True)))


def _all_left_are(state: State) -> Condition:
    """SQL condition: no open experiment is in another state; for QUEUED, no experiment at all is."""
    others = State if state is State.QUEUED else OPEN
    return not_(of_one(_E.state.in_([each for each in others if each is not state])))


def _id(operator: str, value: Value) -> Condition:
    """SQL condition: the id of the study, or of one of its experiments."""
    own, theirs = (fields.text(column, "").meets(operator, value) for column in (_S.id, _E.id))
    return or_(own, of_one(theirs))


def _name(field: str) -> ColumnElement[str]:
    """SQL: the name of a plug-in of the spec; NULL for none."""
    name: ColumnElement[str] = _E.spec[field]["name"].as_string()
    return name


def _of_robots() -> ColumnElement[str]:
    """SQL: the name that people know the robot by."""
    plugin, name = (_E.spec["robot"][place] for place in ("name", "options"))
    return case((plugin.as_string() == IMPORTED, name["name"].as_string()), else_=plugin.as_string())


OF_EXPERIMENTS: Fields = {
    "experiment": fields.text(_E.name, "name of an experiment"),
    "experiment_state": fields.state(lambda state: _E.state == state, "state of an experiment"),
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
    "fitness": fields.fitness(_E.id, *points_of_all(), "fitness after the last common number of evaluations"),
    "best_fitness": fields.fitness(_E.id, *best_of_all(), "best recorded fitness, averaged over repetitions"),
    "iterations": fields.whole(_E.spec["iterations"].as_integer(), "iterations of a repetition"),
    "repetitions": fields.whole(_E.spec["repetitions"].as_integer(), "repetitions"),
    "priority": fields.whole(-_E.precedence, "priority"),
    "started": fields.moment(_E.started_at, "time of its start"),
    "ended": fields.moment(_E.ended_at, "time of its end"),
}
"""The fields that ask for one of a study's experiments."""

FIELDS: Fields = {
    "id": Field("id of the study, or of one of its experiments", fields.TEXT, _id),
    "name": fields.text(_S.name, "name of the study"),
    "note": fields.text(_S.notes, "notes of the study"),
    "tag": fields.tags(_S.tags, "a tag of the study"),
    "state": fields.state(study_is, "state of the study"),
    **OF_EXPERIMENTS,
    "created": fields.moment(_S.created_at, "time of its submission"),
    _ARCHIVED: fields.flag(_S.archived_at.is_not(None), "whether it is archived"),
}
"""All fields."""

_TEXTS = (_S.name, _S.id, _S.notes, _S.tags)
"""Columns in which words are searched for."""


def conditions(query: str | None) -> list[Condition]:
    """Return the SQL conditions of a query on studies; archived ones only if it asks for them.

    Raises:
        InvalidSpec: the query is invalid; the message has the place.
    """
    tree, shown = parse(query or ""), _S.archived_at.is_(None)
    if tree is None:
        return [shown]
    condition = _condition(tree)
    return [condition] if _mentions(tree, _ARCHIVED) else [condition, shown]


def _condition(tree: Tree) -> Condition:
    return of_one(_joined(tree)) if _asks_for_one(tree) else _joined(tree)


def _joined(tree: Tree) -> Condition:
    """Return the condition on a study; or on an experiment, if the tree asks for one."""
    match tree:
        case Words(value):
            return containing(value.text)
        case Term():
            return _compared(tree)
        case Not(part):
            return not_(_condition(part))
        case Every(parts):
            ones = [_joined(part) for part in parts if _asks_for_one(part)]
            others = [_joined(part) for part in parts if not _asks_for_one(part)]
            return and_(*ones) if not others else and_(*([of_one(and_(*ones))] if ones else []), *others)
        case Some(parts):
            return or_(*(_joined(part) if _asks_for_one(tree) else _condition(part) for part in parts))


def _asks_for_one(tree: Tree) -> bool:
    """Return whether all of the tree is about one experiment of a study."""
    match tree:
        case Term():
            return tree.operator not in _NEGATED and tree.field.text.lower() in OF_EXPERIMENTS
        case Every(parts) | Some(parts):
            return all(map(_asks_for_one, parts))
    return False


def _compared(tree: Term) -> Condition:
    """Return the condition on a study, or on an experiment for a field of experiments without a negated operator."""
    field = field_of(FIELDS, tree.field)
    operator = _NEGATED.get(tree.operator, tree.operator)
    single = "=" if operator == "in" else operator
    if single not in field.operators:
        permitted = _permitted(field)
        message = f"{tree.field.text!r} has no operator {tree.operator}; permitted: {', '.join(permitted)}"
        raise refusal(Value(tree.operator, tree.field.place), message, permitted)
    met = or_(*(field.meets(single, value) for value in tree.values))
    if tree.operator not in _NEGATED:
        return met
    return not_(of_one(met) if tree.field.text.lower() in OF_EXPERIMENTS else met)


def _permitted(field: Field) -> list[str]:
    negated = {meant: written for written, meant in _NEGATED.items()}
    both = [each for operator in field.operators for each in (operator, negated.get(operator)) if each]
    return [*both, "in", "not in"]


def _mentions(tree: Tree, name: str) -> bool:
    named = isinstance(tree, Term) and tree.field.text.lower() == name
    return named or any(_mentions(part, name) for part in inside(tree))
