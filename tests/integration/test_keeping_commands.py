"""The command and the client query lists, tag, archive and delete, save views, and set webhooks."""

import json
from collections.abc import Callable

import pexpect
import pytest

from gaplab import Client, ServiceError
from gaplab.api.commands.exit_codes import Exit
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import cancel, listed, submit_one, toy


def test_the_command_queries_tags_archives_and_deletes(gaplab: Gaplab, sqlite_store: Store) -> None:
    made, other = (submit_one(sqlite_store, toy(name=name)).id for name in ("one", "two"))

    assert gaplab("tag", made, "gait", "Paper").out == f"{made}: one [gait, paper]\n"
    assert "[gait]" in gaplab("tag", made, "paper", "--remove").out
    listed = gaplab("list", "--query", "tag = gait and strategy = simulated_fit").out
    assert (made in listed, other in listed) == (True, False)
    assert "Nothing fits." in gaplab("list", "-q", "tag = gait and strategy = random").out
    wrong = gaplab("list", "--query", "strategi = random")
    assert (wrong.code, wrong.err.count("\n")) == (5, 1)
    assert "at character 1: unknown field 'strategi' (did you mean 'strategy'?)" in wrong.err
    refused = gaplab("delete", made, "--yes")
    assert (refused.code, "cancel it first" in refused.err) == (6, True)
    cancel(sqlite_store, made)
    assert "is archived" in gaplab("archive", made).out
    assert made not in gaplab("list").out
    assert made in gaplab("list", "--query", "archived = true").out
    assert "listed again" in gaplab("unarchive", made).out
    assert json.loads(gaplab("delete", made, "--yes", "--json").out)["id"] == made
    gone = gaplab("show", made)
    assert (gone.code, "was deleted at" in gone.err) == (4, True)


def test_a_tag_that_is_none_is_refused_with_what_is_permitted(gaplab: Gaplab, sqlite_store: Store) -> None:
    made = submit_one(sqlite_store, toy()).id
    permitted = "must be letters, digits and _ . : / + -, the first a letter or a digit"

    for tag, *options in (("Bad Tag",), ("",), ("_x",), ("Bad Tag", "--remove")):
        said = gaplab("tag", made, tag, *options)

        assert (said.code, said.err.count("\n")) == (5, 1)
        assert said.err.endswith(f'{permitted}, not "{tag}"\n')


def test_views_are_saved_listed_and_deleted_by_command(gaplab: Gaplab, sqlite_store: Store) -> None:
    made = submit_one(sqlite_store, toy(name="one")).id
    submit_one(sqlite_store, toy(name="two"))

    assert "No views yet" in gaplab("views").out
    assert gaplab("views", "save", "my ones", "--query", "name = one").code == 0
    assert "name = one" in gaplab("views").out
    assert [each["id"] for each in json.loads(gaplab("list", "--view", "my ones", "--json").out)] == [made]
    assert json.loads(gaplab("list", "--view", "my ones", "--query", "name = two", "--json").out) == []
    assert gaplab("views", "save", "bad", "--query", "name =").code == 5
    assert gaplab("list", "--view", "nobody").code == 4
    assert gaplab("views", "delete", "my ones").code == 0


def test_the_client_does_the_same(url: str, sqlite_store: Store) -> None:
    made = submit_one(sqlite_store, toy(name="one")).id
    cancel(sqlite_store, made)
    with Client(url) as client:
        assert client.tag(made, "gait").tags == ("gait",)
        assert [each.id for each in client.studies(query="tag = gait").items] == [made]
        with pytest.raises(ValueError, match="at least one tag"):
            client.untag(made)
        assert client.archive(made).archived_at is not None
        assert client.studies().items == ()
        client.save_view("gaits", "tag = gait")
        assert [view.name for view in client.views()] == ["gaits"]
        with pytest.raises(ServiceError, match="GAPLAB_NOTIFY_HOSTS"):
            client.notify(made, "https://hooks.example.org/x")
        assert client.notify(made, None).host is None
        assert client.delete(made) == client.delete(made)
        with pytest.raises(ServiceError, match="there is no study or experiment"):
            client.delete("nobody")


@pytest.mark.parametrize(("answer", "code"), [("n", Exit.INTERRUPTED), ("y", Exit.OK)])
def test_deletion_asks_in_a_terminal(
    at_a_terminal: Callable[[str, str, str], pexpect.spawn], sqlite_store: Store, answer: str, code: Exit
) -> None:
    made = submit_one(sqlite_store, toy(name="one")).id
    cancel(sqlite_store, made)

    child = at_a_terminal(f"gaplab delete {made}", "Delete 'one' with 3 repetitions for good? [y/N] ", answer)

    assert child.exitstatus == code
    assert bool(listed(sqlite_store)) == bool(code)


def test_without_a_terminal_nothing_is_deleted_unless_the_command_says_yes(gaplab: Gaplab, sqlite_store: Store) -> None:
    made = submit_one(sqlite_store, toy(name="one")).id
    cancel(sqlite_store, made)

    refused = gaplab("delete", made, stdin="y\n")

    assert refused.code == Exit.USAGE
    assert refused.err == "gaplab: to delete 'one' with 3 repetitions for good without a terminal, add --yes\n"
    assert listed(sqlite_store)
    assert gaplab("delete", made, "--yes").code == Exit.OK
