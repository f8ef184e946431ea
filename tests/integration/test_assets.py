"""Files of the page: small on the way, and not sent twice."""

import json
import re
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from plotly.offline import get_plotlyjs_version

from gaplab.api.app import create_app
from gaplab.api.http.assets import modules_of, version_of
from gaplab.api.routes.dashboard import FILES
from gaplab.schemas.spec import StudySpec
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.specs.resolution import resolve
from gaplab.services.store.session import Store
from tests.figures import FIGURES

EXAMPLES = Path(__file__).parents[2] / "examples"
PRESETS = {each["name"]: each["spec"] for each in json.loads((FILES / "presets.json").read_text())}


@pytest.fixture
def api(sqlite_store: Store) -> TestClient:
    return TestClient(create_app(sqlite_store))


def test_plotly_is_sent_compressed_under_an_address_that_is_kept_for_good(api: TestClient) -> None:
    version = api.get("/").text.split('data-plotly="')[1].split('"')[0]
    path = f"/assets/plotly/plotly-basic.min.js?v={version}"

    packed = api.get(path, headers={"accept-encoding": "gzip"})
    plain = api.get(path, headers={"accept-encoding": "identity"})

    assert packed.headers["content-encoding"] == "gzip"
    assert "content-encoding" not in plain.headers
    assert packed.content == plain.content
    assert int(packed.headers["content-length"]) < int(plain.headers["content-length"]) / 2
    assert "immutable" in packed.headers["cache-control"]
    assert packed.headers["content-security-policy"].startswith("default-src 'none'")


def test_the_page_loads_as_much_of_plotly_as_figures_use_in_the_version_that_notebooks_have(api: TestClient) -> None:
    (script,) = re.findall(r"assets/plotly/[\w.-]+", api.get("/assets/dashboard/lib/plot.js").text)

    sent = api.get(script).text

    assert len(sent) < 1_500_000  # a browser compiles five in seconds
    assert f"(basic - minified) v{get_plotlyjs_version()}" in sent[:100]
    assert {each["type"] for figure in FIGURES for each in chart(figure)["data"]} == {"scatter", "bar"}


def test_a_module_that_has_not_changed_is_not_sent_again(api: TestClient) -> None:
    for encoding in ("gzip", "identity"):
        first = api.get("/assets/dashboard/app.js", headers={"accept-encoding": encoding})
        headers = {"accept-encoding": encoding, "if-none-match": first.headers["etag"]}

        again = api.get("/assets/dashboard/app.js", headers=headers)

        assert first.headers["cache-control"] == again.headers["cache-control"] == "no-cache"
        assert first.headers["vary"] == "Accept-Encoding"
        assert (again.status_code, again.content) == (304, b"")


def test_the_next_visit_asks_for_no_module(api: TestClient, tmp_path: Path) -> None:
    (app,) = re.findall(r'src="(assets/[^"]+/app.js)"', api.get("/").text)

    found, older = api.get(f"/{app}"), api.get("/assets/0123456789ab/dashboard/app.js")

    assert found.text == older.text == (FILES / "app.js").read_text()
    assert "immutable" in found.headers["cache-control"]
    assert older.headers["cache-control"] == "no-cache"
    (tmp_path / "a.js").write_text("1")
    before = version_of(tmp_path)
    (tmp_path / "a.js").write_text("12")
    assert version_of(tmp_path) != before


def test_the_page_names_all_modules_at_once(api: TestClient) -> None:
    html = api.get("/").text
    preloaded = re.findall(r'rel="modulepreload" href="(assets/[^"]+/dashboard/)([^"]+)"', html)
    of_views = json.loads(html.split('id="modules">')[1].split("<")[0])

    asked = {base + path for base, path in preloaded}
    asked |= {preloaded[0][0] + path for paths in of_views.values() for path in paths}
    named = {path.removeprefix(preloaded[0][0]) for path in asked} | {"app.js"}
    imported = re.compile(r'^(?:import|export)[^"\']*"(\.[^"]+)"', re.MULTILINE)
    wanted = {
        (FILES / path).parent.joinpath(each).resolve().relative_to(FILES.resolve()).as_posix()
        for path in named
        for each in imported.findall((FILES / path).read_text())
    }

    assert set(of_views) == {path.stem for path in (FILES / "views").glob("*.js")}
    assert {api.get(f"/{path}").status_code for path in asked} == {200}
    assert wanted <= named
    assert not {path for _, path in preloaded} & {path for paths in of_views.values() for path in paths}


def test_modules_that_import_each_other_are_named_once(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "a.js").write_text(
        'import {\n  b,\n} from "./lib/b.js";\nexport { c } from "./c.js";\nimport "plotly";\n'
    )
    (tmp_path / "lib/b.js").write_text('import { a } from "../a.js";\nconst late = import("./d.js");\n')
    (tmp_path / "c.js").write_text('import "./lib/b.js";\n')

    assert modules_of(tmp_path, "a.js") == ("a.js", "lib/b.js", "c.js")


def test_a_module_is_script_also_where_it_is_compressed(api: TestClient) -> None:
    for path in ("app.js", "views/list.js"):
        answer = api.get(f"/assets/dashboard/{path}", headers={"accept-encoding": "gzip"})

        assert answer.headers["content-type"].startswith("text/javascript")
        assert answer.text == (FILES / path).read_text()


def test_a_file_is_sent_whole_whatever_part_of_it_is_asked_for(api: TestClient) -> None:
    for path in ("/assets/dashboard/app.js", "/assets/docs/favicon.png"):
        whole = api.get(path, headers={"accept-encoding": "identity"})
        for part in ("bytes=0-3", "bytes=99999999-", "bytes=nonsense", "parsecs=1-2"):
            answer = api.get(path, headers={"accept-encoding": "identity", "range": part})

            assert (answer.status_code, answer.content) == (200, whole.content)
            assert answer.headers["accept-ranges"] == "none"


def test_nothing_outside_the_folder_is_served(api: TestClient) -> None:
    for path in ("/assets/dashboard/../app.py", "/assets/dashboard/%2e%2e/app.py", "/assets/dashboard/no.js"):
        assert api.get(path).status_code == 404


def test_long_lists_are_sent_compressed(api: TestClient) -> None:
    for _ in range(4):
        api.post("/studies", json={"robot": "toy_function", "budget": "smoke"})

    answer = api.get("/studies", headers={"accept-encoding": "gzip"})

    assert answer.headers["content-encoding"] == "gzip"
    assert len(answer.content) > 3 * int(answer.headers["content-length"])


def test_the_starts_of_the_form_can_be_submitted_and_have_the_examples() -> None:
    starts = [resolve(StudySpec.model_validate(spec)) for spec in PRESETS.values()]
    for file in ("toy", "quadruped", "weights", "figure_4"):
        example = json.loads((EXAMPLES / f"{file}.json").read_text())

        assert starts.count(resolve(StudySpec.model_validate(example))) == 1, file


def test_the_catalogue_has_the_named_budgets() -> None:
    found = {each.name: each for each in catalogue().budgets}

    assert list(found) == ["smoke", "desk", "paper", "lean", "as_published"]
    assert (found["paper"].iterations, found["paper"].repetitions, found["paper"].controller_evaluations) == (
        10,
        40,
        10_000,
    )


def test_files_of_the_page_are_short_and_say_what_they_are() -> None:
    texts = {path: path.read_text() for path in FILES.rglob("*.*")}
    begin = {".js": "// @ts-check\n/**", ".css": "/*"}

    code = {path: text for path, text in texts.items() if path.suffix in begin}
    long = [path.name for path, text in code.items() if len(text.splitlines()) > 400]
    silent = [path.name for path, text in code.items() if not text.startswith(begin[path.suffix])]
    linking = [path.name for path, text in texts.items() if re.search(r"https?://(?!www\.w3\.org/)", text)]

    assert (long, silent, linking) == ([], [], [])


def test_the_catalogue_has_what_a_study_leaves_out() -> None:
    assert StudySpec.model_validate(catalogue().defaults) == StudySpec()


def test_the_catalogue_tells_functions_from_robots_with_bodies() -> None:
    functions = {each.name: each.details["function"] for each in catalogue().robots}

    assert (functions["toy_function"], functions["quadruped"]) == (True, False)


def test_the_direct_baseline_is_marked_as_such_and_no_other_experiment_is(api: TestClient) -> None:
    study = api.post("/studies", json={"robot": "toy_function", "budget": "smoke", "iterations": 1}).json()

    assert [each["strategy"] for each in study["experiments"] if each["direct"]] == ["direct"]
