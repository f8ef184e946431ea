"""Tags, notes, queries, saved views, archived records and deletion on the page."""

from typing import Any

import pytest
from playwright.sync_api import expect

from gaplab.schemas.editing import Edit
from gaplab.schemas.lifecycle import Verb
from gaplab.services.experiments import editing, lifecycle
from tests.e2e.browser import axe, fits, screenshot
from tests.experiments import submit_one, toy

NOTES = """# Floor

*slippery* and **wet**, see [the lab](https://lab.example/log) and <img src=x onerror="document.title='hacked'">

- `code`
- [bad](javascript:alert(1)) <script>document.title = 'hacked'</script>

![tracker](http://elsewhere.example/x.png)
"""

OF_ANOTHER_SERVICE = """async () => {
    const { markdownNodes } = await import("./assets/dashboard/lib/markdown.js");
    const { h } = await import("./assets/dashboard/lib/dom.js");
    return h("div", {}, ...markdownNodes(`<p onclick="x()" style="color:red">a<b>b</b><script>x()</script>
        <style>p{}</style><svg onload=x()><a href="//e">c</a></svg><a href="javascript:x()">d</a>
        <a href=" https://e">e</a><a href="https://e" target="_self">f</a><iframe src="https://e"></iframe>
        <form action="https://e"><input></form></p>`)).innerHTML;
}"""
"""What the page makes of rendered notes that no service of ours would send."""


def ended(store: Any, name: str, **edit: Any) -> str:
    made = submit_one(store, toy(name=name)).id
    lifecycle.ask(store, made, Verb.CANCEL)
    if edit:
        editing.edit(store, made, Edit(**edit), starting_from=None)
    return made


def only_one(page: Any) -> None:
    """Wait until the list has one row."""
    page.locator("tbody tr").first.wait_for()
    page.locator("tbody tr").nth(1).wait_for(state="detached")


def test_notes_are_rendered_of_what_is_known_and_run_and_load_nothing(visit: Any, api: Any, written: Any) -> None:
    visit.forgive("Executing inline event handler")  # the policy of the page refuses it as well
    made = ended(written, "noted", notes=NOTES, tags=("gait", "paper"))
    page = visit(f"{api.url}/#/experiments/{made}")
    page.locator(".notes em").wait_for()
    axe(page)

    notes = page.locator(".notes")
    assert notes.locator("em").inner_text() == "slippery"
    assert notes.locator("h3").inner_text() == "Floor"
    assert notes.locator("img, script, iframe, [onerror]").count() == 0
    link = notes.get_by_role("link", name="the lab")
    assert (link.get_attribute("href"), link.get_attribute("rel")) == (
        "https://lab.example/log",
        "noopener noreferrer nofollow",
    )
    assert notes.locator("a[href^=javascript]").count() == 0
    assert "hacked" not in page.title()
    html = page.evaluate(OF_ANOTHER_SERVICE)
    words = ["onclick", "style", "script", "svg", "onload", "javascript", "iframe", "form", "input", "_self", "<b>"]
    assert [word for word in words if word in html] == []
    assert '<a href="https://e" rel="noopener noreferrer nofollow" target="_blank">f</a>' in html
    page.get_by_role("link", name="gait").click()
    page.locator("tr.study").first.wait_for()
    assert page.get_by_role("searchbox").input_value() == "tag = gait"


def test_a_query_finds_is_explained_and_is_saved_as_a_view(visit: Any, api: Any, written: Any) -> None:
    visit.forgive("422")
    ended(written, "walks", tags=("findable",), notes="slippery")
    page = visit(api.url)
    page.locator("tbody tr").first.wait_for()
    search = page.get_by_role("searchbox")

    search.fill("tag = findable and strateg = simulated_fit")
    page.get_by_text("did you mean 'strategy'?").wait_for()
    assert page.locator("tbody tr").count() > 0
    search.fill("tag = findable and strategy = simulated_fit")
    only_one(page)
    assert page.locator(".mistake").inner_text() == ""
    page.get_by_role("button", name="Save as a view…").click()
    page.get_by_label("Name", exact=True).fill("found ones")
    page.get_by_role("button", name="Save", exact=True).click()
    page.get_by_role("link", name="found ones").wait_for()
    page.get_by_text("How to search").click()
    axe(page)
    screenshot(page, "views-light")
    page.locator(".brand").click()
    page.locator("tbody tr").nth(1).wait_for()
    page.get_by_role("link", name="found ones").click()
    only_one(page)
    page.set_viewport_size({"width": 375, "height": 760})
    fits(page)
    page.get_by_role("button", name="Delete the view found ones").click()
    page.get_by_role("button", name="Delete it").click()
    page.get_by_role("link", name="found ones").wait_for(state="detached")


@pytest.mark.release
def test_a_view_that_sorts_downwards_keeps_its_order(visit: Any, api: Any, written: Any) -> None:
    for name in ("reversed b", "reversed c", "reversed a"):
        ended(written, name, tags=("reversed",))
    assert api.http.put("/views/all downwards", json={"query": "tag = reversed", "sort": "-name"}).is_success
    page = visit(api.url)

    page.get_by_role("link", name="all downwards").click()
    page.locator(".chip[aria-current]", has_text="all downwards").wait_for()
    expect(page.locator("td.name a:not(.tag)")).to_have_text(["reversed c", "reversed b", "reversed a"])
    assert page.get_by_label("Order").input_value() == "-name"
    assert api.http.delete("/views/all downwards").is_success


@pytest.mark.release
def test_what_has_ended_is_archived_and_deleted_by_its_name_and_what_runs_is_not(
    visit: Any, api: Any, written: Any
) -> None:
    visit.forgive("404")
    made = submit_one(written, toy(name="obsolete")).id
    page = visit(f"{api.url}/#/experiments/{made}")
    watching = visit(f"{api.url}/#/experiments/{made}")
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Delete…").click(force=True)
    page.get_by_text("Only what has ended can be deleted").wait_for()

    lifecycle.ask(written, made, Verb.CANCEL)
    page.locator(".state-now .cancelled").wait_for()
    page.get_by_role("button", name="Archive", exact=True).click()
    page.get_by_role("button", name="Unarchive").wait_for()
    page.get_by_role("button", name="Notify…").click()
    page.get_by_role("button", name="Back").click()

    page.get_by_role("button", name="Delete…").click()
    page.get_by_label("Type its name to confirm").fill("obsolet")
    page.get_by_role("button", name="Delete it").click()
    page.get_by_text("That is not its name").wait_for()
    screenshot(page, "delete-light")
    page.get_by_label("Type its name to confirm").fill("obsolete")
    page.get_by_role("button", name="Delete it").click()

    page.get_by_role("searchbox").wait_for()
    watching.get_by_text("was deleted at").first.wait_for()
