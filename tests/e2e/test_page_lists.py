"""The page without workers: lists, filters, a study, the form and its errors; for eyes, ears, keyboards and phones."""

import json
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

from gaplab.schemas.access import Role
from gaplab.services.access import create_token
from gaplab.services.store.session import Store
from tests.e2e.api_alone import Api
from tests.e2e.browser import CONTRAST, axe, fits, screenshot
from tests.experiments import cancel, submit_one, toy

PUBLISHED = "Fig. 4, lean: MuJoCo in MuJoCo"
QUEUED = {"robot": "toy_function", "strategies": ["random", "direct"], "budget": "smoke"}
REFUSED = ("422",)


@pytest.fixture(scope="session")
def published(archive: Any) -> Any:
    """The study that is published with this repository."""
    return archive.get("/studies", text=PUBLISHED)["items"][0]


USUAL = {"list", "studies", "experiments", "new", "bench"}
"""Views that are tried for every change; the others are for a release."""


def test_every_view_can_be_used_in_light_in_dark_and_on_a_phone(
    visit: Any, api: Any, known: Any, pytestconfig: pytest.Config
) -> None:
    visit.forgive("404")
    page = visit(api.url, width=1440)
    for view, ready in {
        "": ".list tbody tr",
        "#/?state=CANCELLED": ".list tbody tr",
        f"#/studies/{known.study}": ".plot .scatterlayer .trace",
        f"#/experiments/{known.ids[0]}": ".figure-curves .point",
        f"#/compare?experiments={','.join(known.ids)}": ".large .scatterlayer .trace",
        "#/new": ".panel .big",
        "#/bench": "text=Nothing is to be measured now.",
        f"#/toy?experiment={known.ids[0]}&iteration=4": ".toy .main-svg",
        f"#/replay?experiment={known.strider}&repetition=0&iteration=0": ".gait .main-svg",
        "#/nowhere": ".empty",
        "#/studies/no-such-study": ".failed h1",
    }.items():
        name = view.strip("#/").split("/")[0].split("?")[0] or "list"
        if name not in USUAL and not pytestconfig.getoption("all"):
            continue
        page.set_viewport_size({"width": 1440, "height": 900})
        page.emulate_media(color_scheme="light")
        page.goto(f"{api.url}/{view}")
        page.locator(ready).first.wait_for(state="attached")
        axe(page)
        screenshot(page, f"{name}-light")
        page.emulate_media(color_scheme="dark")
        page.set_viewport_size({"width": 390, "height": 844})
        axe(page, CONTRAST)
        fits(page)
        screenshot(page, f"{name}-dark-phone")


def test_studies_are_found_opened_ticked_and_compared(visit: Any, api: Any, known: Any) -> None:
    page = visit(api.url)
    page.locator(".list tbody tr").nth(9).wait_for()

    page.get_by_label("Search by words or a query").press_sequentially("a study")
    assert page.evaluate("location.hash") == "#/?q=a+study"  # at once
    page.locator("tr.study").nth(1).wait_for(state="detached")
    page.get_by_role("button", name="Experiments of made: a study").press("Enter")
    page.locator("tr.nested").nth(2).wait_for()
    page.get_by_label("Select known_fit").check()
    page.get_by_label("Select direct").check()
    half = page.get_by_label("Select made: a study").evaluate("box => box.indeterminate")
    found = page.get_by_role("link", name="Compare", exact=True).last.get_attribute("href")

    assert half
    ids = parse_qs(urlsplit(found.removeprefix("#")).query)["experiments"][0].split(",")
    assert set(ids) == set(known.ids[1:])
    page.reload()
    page.locator("tr.study").first.wait_for()
    assert page.locator("tr.study").count() == 1


def test_studies_are_filtered_sorted_and_shown_page_by_page(visit: Any, api: Any) -> None:
    page = visit(api.url)
    page.locator("tr.study").nth(19).wait_for()
    assert page.locator("tr.study").count() == 20

    page.get_by_role("button", name="Show more").click()
    page.locator("tr.study").nth(29).wait_for()
    page.get_by_label("State").select_option("CANCELLED")
    page.locator("tr.study", has_text="completed").first.wait_for(state="detached")
    assert page.locator("tr.study").count() == page.locator("tr.study .cancelled").count() > 0
    page.get_by_label("State").select_option("PAUSED")
    page.get_by_label("Strategy").select_option("known_fit")
    page.get_by_text("Nothing fits these filters").wait_for()
    page.get_by_role("link", name="Show everything").click()

    page.locator(".list tbody tr").nth(5).wait_for()


def test_the_heads_of_columns_sort_studies_and_say_so(visit: Any, api: Any, known: Any) -> None:
    page = visit(f"{api.url}/#/?q=known_fit+or+name+~+study")
    page.locator("tr.study").first.wait_for()
    fitness = page.get_by_role("columnheader", name="Fitness")

    fitness.get_by_role("button").click()
    page.locator("th[aria-sort=descending]", has_text="Fitness").wait_for()
    assert "sort=-fitness" in page.url
    assert page.get_by_label("Order").input_value() == "-fitness"
    fitness.get_by_role("button").press("Enter")

    page.locator("th[aria-sort=ascending]", has_text="Fitness").wait_for()
    assert fitness.get_by_role("button").evaluate("(button) => button === document.activeElement")


def test_several_ticked_studies_are_tagged_archived_exported_and_deleted(visit: Any, api: Any, written: Store) -> None:
    visit.forgive("409")
    names = ("first of two", "second of two")
    ids = [submit_one(written, toy(name=name)).id for name in names]
    cancel(written, ids[0])
    page = visit(f"{api.url}/#/?q=of+two")
    for name in names:
        page.get_by_label(f"Select {name}").check()
    bar = page.get_by_role("region", name="Selected experiments")
    bar.get_by_text("2 studies selected").wait_for()

    bar.get_by_role("button", name="Tag…").click()
    page.get_by_label("Add").fill("pair")
    page.get_by_role("button", name="Tag them").click()
    bar.get_by_text("2 studies tagged.").wait_for()
    assert {tuple(api.get(f"/studies/{each}")["tags"]) for each in ids} == {("pair",)}

    bar.get_by_role("button", name="Archive").click()
    bar.get_by_text("1 study archived. “second of two” was not:").wait_for()
    axe(page)

    cancel(written, ids[1])
    with page.expect_download() as saved:
        bar.get_by_role("button", name="Export").click()
    assert saved.value.path().read_bytes().startswith(b"PK")
    bar.get_by_text("2 studies exported.").wait_for()

    bar.get_by_role("button", name="Delete…").click()
    page.get_by_label("Type the number of studies").fill("2")
    page.get_by_role("button", name="Delete for good").click()
    bar.get_by_text("2 studies deleted.").wait_for()
    assert {api.http.get(f"/studies/{each}").status_code for each in ids} == {404}


def test_what_is_submitted_and_cancelled_elsewhere_is_seen_also_a_single_experiment(
    visit: Any, api: Any, written: Store
) -> None:
    page = visit(f"{api.url}/#/nowhere")
    with page.expect_response("**/events*"):  # until it listens
        page.goto(f"{api.url}/#/")
    page.locator("tr.study").first.wait_for()

    made = api.http.post("/studies", json=QUEUED | {"name": "from elsewhere"}).json()["id"]
    submit_one(written, toy(name="all alone"))
    row = page.locator("tr.study", has_text="from elsewhere")
    row.locator(".queued").wait_for()
    alone = page.locator("tr.study", has=page.get_by_role("link", name="all alone"))
    alone.get_by_text("Simulated fit").wait_for()
    assert alone.get_by_role("button").count() == 0
    api.http.post(f"/studies/{made}/cancel")

    row.locator(".cancelled").wait_for()


@pytest.mark.release
def test_a_study_is_renamed_and_nobody_is_written_over(visit: Any, archive: Any) -> None:
    visit.forgive("412")
    made = archive.http.post("/studies", json=QUEUED | {"name": "first name"}).json()["id"]
    page = visit(f"{archive.url}/#/studies/{made}")
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Edit name, notes and tags").click()
    archive.http.patch(f"/studies/{made}", json={"notes": "of somebody else"}, headers={"If-Match": "*"})
    page.get_by_label("Name", exact=True).fill("second name")

    page.get_by_role("button", name="Save").click()
    page.get_by_text("Somebody changed it meanwhile").wait_for()
    axe(page)
    page.get_by_role("button", name="Save").click()

    page.get_by_role("heading", name="second name").wait_for()
    assert archive.get(f"/studies/{made}")["name"] == "second name"
    archive.http.post(f"/studies/{made}/cancel")


def test_errors_stand_beside_their_fields_until_they_are_right(visit: Any, api: Any) -> None:
    visit.forgive(*REFUSED)
    page = visit(f"{api.url}/#/new")
    page.locator(".panel .big").wait_for()

    page.get_by_label("Iterations").fill("many")
    page.get_by_label("Restitution from").fill("-1")
    page.get_by_text("Advanced").first.click()
    page.get_by_label("Static friction", exact=True).last.fill("99")
    page.locator(".trouble", has_text="whole number").or_(page.locator(".trouble", has_text="integer")).wait_for()
    page.get_by_label("Iterations").fill("")
    page.locator(".trouble", has_text="static_friction must be from 0 to 10, not 99").wait_for()
    page.locator(".trouble", has_text="restitution must be from 0 to 0.9, not -1").wait_for()
    axe(page)
    screenshot(page, "new-errors")
    assert page.locator("[aria-invalid]").count() == 2
    page.get_by_role("button", name="Submit the study").click()
    page.get_by_text("The study was not submitted").wait_for()
    page.get_by_label("Restitution from").fill("")
    page.get_by_label("Static friction", exact=True).last.fill("0.5")

    page.locator(".panel .big").wait_for()
    assert page.locator("[aria-invalid]").count() == 0


def test_the_form_holds_every_start_and_what_one_copies_is_what_it_submits(visit: Any, api: Any) -> None:
    page = visit(f"{api.url}/#/new")
    page.locator(".starts button").first.wait_for()
    names = page.locator(".starts button").all_text_contents()
    assert len(names) == 5

    for name in names:
        page.get_by_role("button", name=name, exact=True).click()
        spec = json.loads(page.locator("#panel-json code").text_content())
        answer = api.http.post("/studies/estimate", json=spec)
        assert answer.status_code == 200, answer.text
        page.get_by_text(f"{answer.json()['rollouts']:,} rollouts at most").wait_for()
    page.get_by_role("tab", name="Python").click()
    compile(page.locator("#panel-python code").text_content(), "the page", "exec")
    page.get_by_role("tab", name="curl").press("ArrowLeft")
    page.locator("#panel-json").get_by_role("button", name="Copy").click()
    assert json.loads(page.evaluate("() => navigator.clipboard.readText()")) == spec


@pytest.mark.release
def test_a_strategy_is_compared_with_itself_under_other_options(visit: Any, archive: Any) -> None:
    visit.forgive(*REFUSED)
    page = visit(f"{archive.url}/#/new")
    page.get_by_role("button", name="None", exact=True).click()
    page.locator(".trouble", has_text="at least 1 item").wait_for()
    box = page.locator(".strategy", has_text="Known fit")
    box.get_by_role("checkbox").check()
    box.get_by_text("Options", exact=True).click()
    box.get_by_label("Spread").fill("0.5")

    box.get_by_role("button", name="Add again").click()
    page.locator(".strategy", has_text="Known fit").nth(1).get_by_label("Spread").fill("0.1")

    page.get_by_text("rollouts at most").wait_for()
    spec = json.loads(page.locator("#panel-json code").text_content())
    assert spec["strategies"] == [
        {"name": "known_fit", "options": {"spread": 0.5}},
        {"name": "known_fit", "options": {"spread": 0.1}},
    ]


def test_the_keyboard_reaches_the_content_and_the_theme_is_remembered(visit: Any, api: Any) -> None:
    page = visit(api.url)
    page.locator("tr.study").first.wait_for()

    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    assert page.evaluate("() => document.activeElement.id") == "main"
    page.get_by_role("button", name="Switch between light and dark").press("Enter")
    page.reload()

    page.locator("tr.study").first.wait_for()
    assert page.evaluate("() => document.documentElement.dataset.theme") == "dark"


def test_an_empty_service_with_tokens_asks_for_one_says_how_to_begin_and_a_reader_may_look_and_estimate(
    visit: Any, sqlite_store: Store, sqlite_url: str, tmp_path: Path
) -> None:
    visit.forgive("401", "403")
    token = create_token(sqlite_store, Role.READER).secret
    api = Api(sqlite_url, tmp_path / "api.log").start()
    try:
        page = visit(api.url)
        page.get_by_role("heading", name="A token, please").wait_for()
        axe(page)
        screenshot(page, "token")
        page.get_by_label("Token").fill(token)
        page.get_by_role("button", name="Go on").click()
        page.get_by_text("Nothing was submitted yet").wait_for()
        axe(page)

        page.get_by_role("link", name="Submit a study").click()
        page.get_by_text("No worker is running now").wait_for()
        page.get_by_text("rollouts at most").wait_for()
        page.get_by_role("button", name="Submit the study").click()
        page.get_by_text("The token does not permit this").wait_for()

        submitted = submit_one(sqlite_store, toy(name="guarded"))
        page.goto(f"{api.url}/#/experiments/{submitted.id}")
        with page.expect_download() as saved:
            page.get_by_role("link", name="Archive of everything").click()
        assert saved.value.url.startswith("blob:")
        assert saved.value.path().read_bytes().startswith(b"PK")
        page.get_by_role("button", name="Pause").click()
        page.locator(".life-cycle .outcome", has_text="runner").wait_for()
        assert "queued" in page.locator(".state-now").inner_text().lower()
        page.close()  # it would say that the service is away
    finally:
        api.close()


def test_an_empty_service_says_what_gaplab_is_and_submits_the_toy_at_one_press(
    visit: Any, sqlite_store: Store, sqlite_url: str, tmp_path: Path
) -> None:
    api = Api(sqlite_url, tmp_path / "api.log").start()
    try:
        page = visit(api.url, width=390, height=844)
        page.get_by_text("it tunes the simulator from a handful of trials in reality").wait_for()
        axe(page)
        fits(page)
        screenshot(page, "empty-phone")

        page.get_by_role("button", name="Try the toy").click()

        page.get_by_role("heading", name="toy", exact=True).wait_for()
        (study,) = api.get("/studies")["items"]
        assert page.url.endswith(f"#/studies/{study['id']}")
        page.close()  # it would say that the service is away
    finally:
        api.close()


def test_a_study_that_is_opened_by_its_address_in_the_api_begins_with_its_verdict_and_facts(
    visit: Any, api: Any, known: Any
) -> None:
    page = visit(f"{api.url}/studies/{known.study}")

    page.locator(".conclusion p").wait_for()
    headline = api.get(f"/studies/{known.study}/report", format="json")["headline"]
    assert page.url == f"{api.url}/#/studies/{known.study}"
    assert page.locator(".conclusion p").first.text_content() == headline
    facts = page.locator(".experiment-head .facts").inner_text()
    for words in ("Toy function", "Analytic", "Smoke: 10 iterations", "static friction"):
        assert words in facts
    assert page.locator(".life-cycle .button:not(.quiet), .life-cycle button:not(.quiet)").all_inner_texts() == [
        "Compare its experiments",
    ]
    page.goto(f"{api.url}/experiments/{known.strider}")
    page.locator(".experiment-head .robot-picture[src]").wait_for()


@pytest.mark.parametrize("width", [1440, 390])
def test_the_form_has_three_steps_and_cost_and_button_are_always_in_view(visit: Any, api: Any, width: int) -> None:
    page = visit(f"{api.url}/#/new", width=width, height=844)
    page.locator(".panel .big").wait_for()
    button = page.get_by_role("button", name="Submit the study")

    assert page.locator(".part > legend").all_inner_texts() == [
        "1. The robot",
        "2. What is compared and tuned",
        "3. Size",
    ]
    assert page.locator(".advanced > details").count() == 3
    assert page.locator(".advanced > details[open]").count() == 0
    for place in ("0", "document.body.scrollHeight / 2", "document.body.scrollHeight"):
        page.evaluate(f"() => scrollTo(0, {place})")
        for shown in (button, page.locator(".panel .big").first):
            page.wait_for_function(
                "(element) => { const { top, bottom } = element.getBoundingClientRect();"
                " return top >= 0 && bottom <= innerHeight; }",
                arg=shown.element_handle(),
            )


@pytest.mark.release
def test_the_line_for_curl_is_one_that_every_shell_takes(visit: Any, api: Any, known: Any) -> None:
    page = visit(f"{api.url}/#/studies/{known.study}")

    call = page.locator(".calls code").first.text_content()

    assert call == f"curl '{api.url}/curves?study={known.study}&format=csv'"


@pytest.mark.release
def test_a_study_is_opened_in_the_form_changed_and_pasted(visit: Any, archive: Any, published: Any) -> None:
    visit.forgive(*REFUSED)
    page = visit(f"{archive.url}/#/studies/{published['id']}")
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="New from this").click()
    page.locator(".panel .big").wait_for()
    spec = json.loads(page.locator("#panel-json code").text_content())
    again = archive.get(f"/studies/{published['id']}/spec")["spec"]
    answers = [archive.http.post("/studies/estimate", json=each).json()["specs"] for each in (spec, again)]
    assert answers[0] == answers[1]

    page.get_by_text("Paste a spec").click()
    pasted = page.get_by_label("Spec of a study or an experiment, as JSON")
    pasted.fill('{"strategy": "randon", "robot": "toy_function"}')
    page.get_by_role("button", name="Fill the form").click()
    page.locator(".paste .trouble", has_text="random").wait_for()
    axe(page)
    screenshot(page, "new-pasted")
    pasted.fill('{"strategy": "random", "robot": "toy_function"}')
    page.get_by_role("button", name="Fill the form").click()
    page.locator(".paste:not([open])").wait_for()

    spec = json.loads(page.locator("#panel-json code").text_content())
    assert (spec["strategies"], spec["robot"]) == (["random"], "toy_function")
