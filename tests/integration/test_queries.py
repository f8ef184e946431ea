"""The query language of lists: the same on both databases, with errors that point at the place."""

from typing import Any

import pytest

from gaplab.schemas.editing import Edit
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.experiments import editing, lifecycle, listing, reading, submission
from gaplab.services.experiments.listing import ListFilter
from gaplab.services.experiments.query.conditions import FIELDS
from gaplab.services.experiments.query.parsing import LONGEST
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.experiments import run, some_log, submit_one, toy


def edit(store: Store, id_: str, **changes: Any) -> None:
    editing.edit(store, id_, Edit(**changes), starting_from=None)


@pytest.fixture
def ids(store: Store) -> dict[str, str]:
    """An experiment that is complete, one that is tagged and noted, one with another strategy, and a study of two."""
    made = {}
    for name, strategy in (("done", "informative"), ("Tagged", "random"), ("other", "simulated_fit")):
        made[name] = submit_one(store, toy(strategy=strategy, name=name, iterations=1, repetitions=2)).id
        if name == "done":
            for number, claim in enumerate(execution.claim(store, "me", 2)):
                run(store, claim, some_log(1, recorded=0.5 + number / 2))
    edit(store, made["Tagged"], tags=("gait", "50-percent"), notes="the floor was *Slippery*, 50% wet")
    spec = {"name": "both", "strategies": ["known_fit", "direct"], "robot": "toy_function", "budget": "smoke"}
    study = submission.submit(store, StudySpec.model_validate(spec))
    edit(store, study.id, tags=("paper",), notes="a bent leg")
    lifecycle.ask(store, study.experiments[1].id, Verb.CANCEL)
    return made | {"both": study.id, "known_fit": study.experiments[0].id}


def found(store: Store, q: str) -> set[str]:
    return {each.name for each in listing.list_studies(store, ListFilter(q=q)).items}


ALL = {"done", "Tagged", "other", "both"}

QUERIES = {
    "": ALL,
    "strategy = informative": {"done"},
    "STRATEGY = informative and STATE = completed": {"done"},
    "strategy != informative": ALL - {"done"},
    "strategy in (informative, random)": {"done", "Tagged"},
    "strategy not in (informative, random)": {"other", "both"},
    "strategy = known_fit": {"both"},
    "strategy != direct": ALL - {"both"},
    "experiment = known_fit": {"both"},
    "strategy = direct and experiment_state = CANCELLED": {"both"},
    "strategy = known_fit and experiment_state = CANCELLED": set(),
    "strategy = known_fit and (strategy = direct or experiment_state = CANCELLED)": set(),
    "(strategy = known_fit) and not strategy = random and experiment_state = CANCELLED": set(),
    "strategy = known_fit and not experiment_state = COMPLETED": {"both"},
    "not strategy = informative or done": ALL,
    "state = RUNNING": {"both"},
    "state = QUEUED and not tag = gait": {"other"},
    "tag = GAIT": {"Tagged"},
    "tag = gai": set(),
    "tag ~ gai": {"Tagged"},
    "tag = paper": {"both"},
    "tag = none": {"done", "other"},
    "tag != gait": ALL - {"Tagged"},
    'note ~ "slippery"': {"Tagged"},
    "note ~ 50%": {"Tagged"},
    "note ~ '%'": {"Tagged"},
    "note ~ _": set(),
    "note = none": {"done", "other"},
    "note !~ slippery": ALL - {"Tagged"},
    "fitness > 1.7": {"done"},
    "fitness = 1.75": {"done"},
    "fitness != 1.75": ALL - {"done"},
    "fitness > 1.75": set(),
    "fitness >= 1.75 and fitness <= 1.75": {"done"},
    "fitness = none": ALL - {"done"},
    "robot = toy_function": ALL,
    "engine = analytic and optimizer = steady_state": ALL,
    "controller_optimizer = steady_state": ALL,
    "controller_optimizer = cma_es": set(),
    "reality = analytic": ALL,
    "repetitions = 2 and iterations = 1": {"done", "Tagged", "other"},
    "iterations < 2 and priority = 0": {"done", "Tagged", "other"},
    "created > -1h": ALL,
    "created < 2012-11-05 or ended > 2012-11-05T09:00": {"done", "both"},
    "ended = none": ALL - {"done"},
    "ended in (none, 2012-11-05)": ALL - {"done"},
    "note not in (None)": {"Tagged", "both"},
    "note ~ bent": {"both"},
    "bent": {"both"},
    "note ~ 'none'": set(),
    "tag ~ 'none'": set(),
    "created > 9999-12-31": set(),
    "created = 9999-12-30": set(),
    "started = 2012-11-05": set(),
    "slippery": {"Tagged"},
    "gait": {"Tagged"},
    "SLIPPERY floor": {"Tagged"},
    "slippery or don": {"done", "Tagged"},
    "(slippery or done) and strategy = random": {"Tagged"},
    "archived = true": set(),
    "archived = any": ALL,
    "name = 'Tagged'": {"Tagged"},
    "name = tagged": set(),
    "name ~ TAGGED": {"Tagged"},
    r'"no \"such\" text"': set(),
}


@pytest.mark.dialects
def test_queries_find_what_they_say(store: Store, ids: dict[str, str]) -> None:
    wrong = {q: names for q, expected in QUERIES.items() if (names := found(store, q)) != expected}

    assert wrong == {}
    assert found(store, f"id = {ids['done']}") == {"done"}
    assert found(store, f"id in ({ids['both']}, x)") == found(store, f"id = {ids['known_fit']}") == {"both"}
    assert found(store, ids["known_fit"]) == {"both"}


@pytest.mark.dialects
def test_the_queried_fitness_is_the_one_that_is_shown(store: Store, ids: dict[str, str]) -> None:
    shown = reading.read_experiment(store, ids["done"])

    assert shown.fitness is not None
    assert shown.best_fitness is not None
    assert found(store, f"fitness = {shown.fitness.mean!r}") == {"done"}
    assert found(store, f"best_fitness = {shown.best_fitness!r}") == {"done"}


ERRORS = {
    "strategi = x": ("character 1: unknown field 'strategi' (did you mean 'strategy'?)", "strategy"),
    "state = COMPLETD": ("character 9: unknown state 'COMPLETD' (did you mean 'COMPLETED'?)", "COMPLETED"),
    "fitness ~ 3": ("character 1: 'fitness' has no operator ~; permitted: =, !=, >, >=, <, <=, in, not in", None),
    "tag > 3": ("'tag' has no operator >; permitted: =, !=, ~, !~, in, not in", None),
    "fitness > much": ("character 11: 'much' is not a number", None),
    "fitness > inf": ("character 11: 'inf' is not a number", None),
    "created > soon": ("character 11: 'soon' is not a time, like 2026-11-05", None),
    "created > -99999999999d": ("is not a time", None),
    "created = 9999-12-31": ("character 11: '9999-12-31' is too late for =; permitted: times before 9999-12-31", None),
    "created != 9999-12-31T23:59:30": ("character 12: '9999-12-31T23:59:30' is too late for =", None),
    "fitness > none": ("character 11: 'none' is what is missing, and has no operator >; permitted: =, !=, in", None),
    "best_fitness <= NONE": ("character 17: 'NONE' is what is missing, and has no operator <=", None),
    "ended < none": ("character 9: 'none' is what is missing, and has no operator <", None),
    "name ~ none": ("character 8: 'none' is what is missing, and has no operator ~; permitted: =, !=, in", None),
    "note !~ none": ("not in; put a text in quotes", None),
    "tag ~ none": ("character 7: 'none' is what is missing, and has no operator ~", None),
    "priority > none": ("character 12: 'none' is not a number", None),
    "archived = maybe": (
        "character 12: unknown value 'maybe' (did you mean 'any'?); permitted: true, false, any",
        "any",
    ),
    "fitness >": ("character 10: the query ends; expected a word or a text in quotes", None),
    "strategy == x": ("character 11: '=' is unexpected", None),
    "(a": ("character 3: the query ends; expected )", None),
    "a)": ("character 2: ')' is unexpected; expected the end", None),
    'note ~ "slippery': ('character 8: the quote " is not closed', None),
    "strategy in ()": ("character 14: ')' is unexpected", None),
    "not": ("the query ends", None),
    "x" * (LONGEST + 1): ("at most 1,000 characters", None),
    "not " * 40 + "a": ("the query is too large", None),
    "(a or " * 120 + "a" + ")" * 120: ("too large", None),
    f"strategy in ({', '.join('x' * 1 for _ in range(200))})": ("too large", None),
}


def test_a_mistake_in_a_query_is_named_with_its_place(sqlite_store: Store) -> None:
    wrong: list[Any] = []
    for q, (message, nearest) in ERRORS.items():
        with pytest.raises(InvalidSpec) as refused:
            found(sqlite_store, q)

        (mistake,) = refused.value.violations
        as_expected = mistake.pointer == "q" and message in mistake.message and mistake.nearest == nearest
        wrong += [] if as_expected else [mistake]

    assert wrong == []


def test_a_query_of_many_parentheses_costs_no_stack(sqlite_store: Store) -> None:
    assert found(sqlite_store, "(" * 400 + "a" + ")" * 400) == set()


@pytest.mark.dialects
def test_every_field_can_be_asked_on_both_databases(store: Store, ids: dict[str, str]) -> None:
    values = {"state": "QUEUED", "experiment_state": "QUEUED", "archived": "any"}

    for name, field in FIELDS.items():
        number = name in {"fitness", "best_fitness", "iterations", "repetitions", "priority"}
        time = name in {"created", "started", "ended"}
        value = values.get(name, "1.5" if number else "2012-11-05" if time else "none")
        for operator in field.operators:
            asked = f'"{value}"' if operator == "~" else value
            found(store, f"{name} {operator} {asked}")
            found(store, f"not ({name} {operator} {asked}) and {name} not in ({value}, {value})")


def test_archived_ones_are_listed_only_if_the_query_asks(store: Store, ids: dict[str, str]) -> None:
    editing.archive(store, ids["done"])
    lifecycle.ask(store, ids["both"], Verb.CANCEL)
    editing.archive(store, ids["both"])

    assert found(store, "") == {"Tagged", "other"}
    assert found(store, "archived = true") == {"done", "both"}
    assert found(store, "done or archived = any") == ALL


@pytest.mark.dialects
def test_a_query_is_paged_and_its_cursor_belongs_to_it(store: Store, ids: dict[str, str]) -> None:
    names, cursor = [], None
    while True:
        page = listing.list_studies(store, ListFilter(q="not done", sort="name"), limit=2, cursor=cursor)
        names += [each.name for each in page.items]
        if (cursor := page.next) is None:
            break
        last = cursor

    assert sorted(names) == sorted(ALL - {"done"})
    with pytest.raises(InvalidSpec, match="other filters"):
        listing.list_studies(store, ListFilter(q="done", sort="name"), limit=2, cursor=last)
