"""What the client returns, at a prompt and in a notebook: one line, a small table, and methods on what one has."""

import copy
import inspect
import pickle
import xml.etree.ElementTree as ET
from base64 import b64decode
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

import gaplab
from gaplab import Client, ServiceError, Study
from gaplab.api.clients.bench import Bench
from gaplab.api.clients.objects import Experiment
from gaplab.schemas.base import LINE
from tests.integration.test_client import BOTH, SMALL, client, network

__all__ = ["client", "network"]

NAMED = BOTH | {"strategies": ["random", "simulated_fit", "direct"], "name": "a <b> & c"}


@pytest.fixture
def study(client: Client, finish: Callable[[], None]) -> Study:
    made = client.submit(NAMED | {"tunables": ["static_friction", "restitution"]})
    finish()
    return made.refresh()


def answers(client: Client, study: Study) -> Iterator[Any]:
    """One of everything that the service answers to readers."""
    one = study.experiments[1]
    yield from (client, client.bench, study, one, client.studies(), client.study(one), study.verdict())
    yield from (study.curves(), study.curves()[0], study.compare(), study.compare()[0], client.diff(study))
    yield from (client.misfit(one), client.provenance(one), client.spec(study), client.estimate(NAMED))
    yield from (client.repetitions(one), client.attempts(one, 0), client.best_simulator(one))
    yield from (client.catalogue(), client.robots(), client.views(), client.view(client.save_view("all").name))
    yield from (client.bench.history(), client.bench.branches(one), client.events(follow=False), study.figure())
    yield from client.events(follow=False)


def test_everything_is_one_line_at_a_prompt(client: Client, study: Study) -> None:
    for found in answers(client, study):
        assert len(repr(found)) <= LINE, found
        assert "\n" not in repr(found)
    assert repr(study).startswith(f"Study(id='{study.id}', name='a <b> & c', state=COMPLETED")
    assert "best=simulated_fit 3." in repr(study)
    assert repr(study.curves()).startswith("<3 Curve: Curve(experiment=")
    assert str(study) == repr(study)
    assert str(study.verdict()).splitlines() == [study.verdict().headline, *study.verdict().sentences]


def test_everything_is_a_small_table_in_a_notebook_and_a_study_has_its_curve(client: Client, study: Study) -> None:
    for found in answers(client, study):
        if hasattr(found, "_repr_html_"):
            shown = found._repr_html_()
            assert len(shown) < 20_000 or "<img" in shown
            assert list(ET.fromstring(f"<p>{shown}</p>").iter("table"))

    page = ET.fromstring(f"<p>{client.studies()._repr_html_()}</p>")
    whole = ET.fromstring(f"<p>{study._repr_html_()}</p>")
    (picture,) = whole.iter("img")
    drawn = b64decode(picture.attrib["src"].partition(",")[2])
    assert [each.text for each in page.iter("td")][:4] == ["id", study.id, "name", "a <b> & c"]
    assert drawn == study.figure(caption=False).content("svg")
    assert study.verdict().headline in "".join(whole.itertext())
    assert len(list(whole.iter("tr"))) == 1 + len(study.experiments)
    assert {"strategy", "state", "fitness"} <= {each.text for each in whole.find(".//tr")}
    assert len(list(ET.fromstring(f"<p>{study.experiments[0]._repr_html_()}</p>").iter("img"))) == 1


def test_a_study_shows_itself_without_a_service_too(client: Client, study: Study) -> None:
    client.close()

    for found in (study, pickle.loads(pickle.dumps(study))):
        assert [each.tag for each in ET.fromstring(f"<p>{found._repr_html_()}</p>").iter("img")] == []
        assert "COMPLETED" in found._repr_html_()


def test_methods_of_a_study_and_an_experiment_give_what_the_client_gives(
    client: Client, study: Study, tmp_path: Path
) -> None:
    one = study.experiments[1]

    for of in (study, one):
        assert of.curve().equals(client.curve(of.id))
        assert of.curve(each=True).equals(client.curve(of.id, each=True))
        assert of.curves() == client.curves(of.id)
        assert of.verdict() == client.verdict(of.id)
        assert of.wait(progress=False) == client.study(of.id)
        assert of.figure(title="").content("json") == client.figure(of.id, title="").content("json")
    assert study.compare(1, 2) == client.compare(study.id, 1, 2)
    assert one.samples(kind="probe").equals(client.samples(one.id, kind="probe"))
    assert one.simulators(iteration=1).equals(client.simulators(one.id, iteration=1))
    assert (study.refresh(), one.refresh()) == (client.study(study.id), client.experiment(one.id))
    assert client.import_(study.save(tmp_path / "study.zip")).study != study.id


def test_what_a_study_is_told_to_do_is_done(client: Client) -> None:
    study = client.submit(BOTH)

    done = [study.pause(), study.resume(), study.stop()]
    one = client.submit(SMALL).experiments[0]

    assert [str(each.state) for each in done[:2]] == ["PAUSED", "QUEUED"]
    assert study.state == "QUEUED"  # as it was read
    assert study.refresh().archive().archived_at is not None
    assert one.cancel().experiments[0].state == "CANCELLED"
    assert one.delete().id == one.id
    with pytest.raises(ServiceError, match="cannot be extended"):
        study.extend(repetitions=4)


def test_copies_are_equal_and_those_of_other_processes_say_that_they_have_no_client(
    client: Client, study: Study
) -> None:
    copied, loaded = copy.copy(study), pickle.loads(pickle.dumps(study))

    assert copy.deepcopy(study) == copied == loaded == study == client.study(study)
    assert copied.curves() == study.curves()
    with pytest.raises(ValueError, match=rf"read it with client.study\('{study.id}'\)"):
        loaded.curves()


def test_completion_and_help_know_every_method_with_its_types(client: Client, study: Study) -> None:
    interpreter = import_module("jedi").Interpreter
    of = {"client": client, "study": study, "bench": client.bench, "figure": study.figure()}

    for name, value in of.items():
        public = {each for each, _ in inspect.getmembers(type(value)) if not each.startswith("_")} - set(dir(BaseModel))
        assert public <= {each.name for each in interpreter(f"{name}.", [of]).complete()}
    assert [each.name for each in interpreter("study.cur", [of]).complete()] == ["curve", "curves"]
    assert {"each="} == {each.name for each in interpreter("study.curve(ea", [of]).complete()}
    for kind in (Client, Bench, Study, Experiment, gaplab.Figure):
        for name, method in inspect.getmembers(kind, inspect.isfunction):
            if not name.startswith("_") and name not in dir(BaseModel):
                assert method.__doc__, name
                assert inspect.signature(method).return_annotation is not inspect.Signature.empty, name
    assert isinstance(inspect.getattr_static(Client, "bench"), property)


def legend(figure: Any) -> list[str]:
    return [each.get_text() for each in figure.legends[0].get_texts()]


def test_a_figure_takes_names_order_and_limits(study: Study) -> None:
    fit = study.experiments[1]
    labels = {"random": "Chance", fit.id: "Ours"}

    figure = study.figure(
        labels=labels, order=[fit, "direct"], xlim=(0, 2), ylim=(-1.5, 4), xlabel="Trials", ylabel="F"
    )

    layout = figure.plotly().layout
    assert (layout.xaxis.range, layout.yaxis.range) == ((0, 2), (-1.5, 4))
    assert (layout.xaxis.title.text, layout.yaxis.title.text) == ("Trials", "F")
    drawn = figure.matplotlib()
    assert legend(drawn) == ["Ours", "Chance", "Direct"]  # the level of direct is the last of all figures
    assert (drawn.axes[0].get_xlim(), drawn.axes[0].get_xlabel()) == ((0.0, 2.0), "Trials")
    assert "Ours" in figure.content("json").decode()
    with pytest.raises(ServiceError, match=r"unknown experiment 'rndom' \(did you mean 'random'\?\)"):
        study.figure(labels={"rndom": "x"}).content("svg")
    with pytest.raises(ServiceError, match=r"ascend"):
        study.figure(xlim=(2, 0)).content("svg")
    with pytest.raises(ServiceError, match="ylim: "):
        study.figure(ylim="high").content("svg")
    with pytest.raises(ServiceError, match="the panels have different axes"):
        fit.figure("squared-error", ylim=(0, 1)).content("svg")
    with pytest.raises(ServiceError, match="unknown parameter 'order'"):
        fit.figure("simulators", order=["random"]).content("svg")


def test_a_figure_is_matplotlibs_with_the_size_and_the_letters_of_its_files(study: Study, tmp_path: Path) -> None:
    figure = study.figure(width=5, height=3, font="STIXGeneral", font_size=10, caption=False, title="")

    drawn = figure.matplotlib()

    size = ET.fromstring(figure.content("svg")).attrib
    assert [float(size[each].removesuffix("pt")) / 72 for each in ("width", "height")] == pytest.approx(
        [*drawn.get_size_inches()], abs=1e-3
    )
    assert drawn.get_figwidth() == 5
    assert drawn.axes[0].get_tightbbox().height / drawn.dpi == pytest.approx(3, rel=0.2)
    texts = [*drawn.legends[0].get_texts(), drawn.axes[0].xaxis.label, *drawn.axes[0].get_xticklabels()]
    assert {(each.get_fontname(), each.get_fontsize()) for each in texts} == {("STIXGeneral", 10.0)}
    drawn.axes[0].set_title("edited")
    drawn.savefig(tmp_path / "edited.pdf")
