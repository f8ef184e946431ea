"""Many tabs of one window: a browser opens six connections to a service, and every tab would like one for itself."""

from typing import Any

import pytest

QUEUED = {"robot": "toy_function", "strategies": ["random"], "budget": "smoke"}
TABS = 8
SEEN = """
(isSeen) => {
  Object.defineProperty(document, "hidden", { configurable: true, get: () => !isSeen });
  document.dispatchEvent(new Event("visibilitychange"));
}
"""


def is_stream(request: Any) -> Any:
    return request.url.split("?")[0].endswith("/events")


@pytest.mark.release
def test_however_many_tabs_are_open_each_shows_its_list(visit: Any, archive: Any) -> None:
    page = visit(archive.url)
    for _ in range(1, TABS):
        page.locator("tr.study").first.wait_for()
        page.evaluate(SEEN, False)
        page = visit(archive.url)

    page.locator("tr.study").first.wait_for()


@pytest.mark.release
def test_a_tab_that_nobody_sees_lets_go_of_its_stream_and_catches_up_when_somebody_does(visit: Any, api: Any) -> None:
    page = visit(f"{api.url}/#/toy")
    with page.expect_response(lambda answer: is_stream(answer.request)):
        page.get_by_role("link", name="Studies").first.click()
    page.locator("tr.study").first.wait_for()
    with page.expect_event("requestfailed", is_stream):
        page.evaluate(SEEN, False)

    made = api.http.post("/studies", json=QUEUED | {"name": "while nobody looked"}).json()["id"]
    page.wait_for_timeout(2_000)  # as long as it would take to listen again
    row = page.locator("tr.study", has_text="while nobody looked")
    assert row.count() == 0
    assert page.locator("#connection").text_content() == ""
    page.evaluate(
        "() => { window.said = []; new MutationObserver(() => window.said.push(1))"
        ".observe(document.getElementById('connection'), { childList: true }); }"
    )
    page.evaluate(SEEN, True)

    row.wait_for()
    assert page.evaluate("() => window.said") == []
    api.http.post(f"/studies/{made}/cancel")
