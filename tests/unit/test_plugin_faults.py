"""Classes that specs cannot use are refused with the reason, before a spec names them."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.strategies import strategies
from gaplab.services.engines import engines
from gaplab.services.plugins.faults import fault_of
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.defaults import completed
from gaplab.services.specs.registries import REGISTRIES
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.stored_specs import spec_of
from tests.experiments import toy
from tests.fakes import CAREFUL

Put = Callable[..., Path]

HEAD = "from pydantic import BaseModel, Field\nfrom gaplab.plugins import Frozen\n"


def with_options(fields: str, base: str = "Frozen", body: str = "") -> str:
    """Return the text of a strategy `careful` with options."""
    model = f"{HEAD}\n\nclass Mine({base}):\n    {fields}\n"
    return model + CAREFUL.replace("searches = False", f"searches = False\n    Options = Mine\n    {body}")


ALIAS = with_options('lambda_: float = Field(default=0.5, alias="lambda")')


@pytest.mark.parametrize("kind", sorted(REGISTRIES))
def test_gaplabs_own_plug_ins_have_no_fault(kind: str) -> None:
    assert {name: fault_of(plugin, kind) for name, plugin in REGISTRIES[kind].items()} == dict.fromkeys(
        REGISTRIES[kind]
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (f"{CAREFUL}\n    def __init__(self):\n        super().__init__()\n", "Careful in careful.py takes no options"),
        (
            f"{CAREFUL}\n    def __init__(self, options):\n        options.gain\n",
            "cannot be created with its default opt",
        ),
        (
            with_options("count: int = Field(default=0, ge=1)"),
            "refuses its own defaults: count must be at least 1, not 0",
        ),
        (with_options("count: int = 2.5"), "refuses its own defaults: count must be a whole number, not 2.5"),
        (with_options('cap: float = float("inf")'), "refuses its own defaults: cap must be a finite number"),
        (
            with_options("count: int = 2", body='presets = {"smith": {"cuont": 3}}'),
            "refuses its own preset 'smith': unknown option of 'careful' 'cuont' (did you mean 'count'?)",
        ),
        (with_options("count: int = 2", base="BaseModel"), "has Options that accept misspelt names: derive them"),
        (CAREFUL.replace('"careful"', '""'), "has no name for specs to use"),
        (CAREFUL.replace('"careful"', '"x" * 101'), "has a name of 101 characters, but specs permit at most 100"),
    ],
)
def test_a_strategy_that_no_spec_could_use_is_unavailable_with_the_reason(put: Put, text: str, says: str) -> None:
    put(careful=text)

    (why,) = strategies.unusable.values()
    assert says in why


@pytest.mark.parametrize("name", ["grip(left)", " grip"])
def test_a_tunable_whose_name_no_label_can_have_is_unavailable(put: Put, name: str) -> None:
    tunable = "from gaplab.plugins import MaterialTunable\n\n\nclass Grip(MaterialTunable):\n"
    put(grip=f"{tunable}    name = {name!r}\n    field = 'material.restitution'\n")

    (why,) = REGISTRIES["tunable"].unusable.values()
    assert f"has the name {name!r}, but parentheses and outer spaces" in why


def test_an_engine_that_takes_no_options_is_unavailable_and_none_is_created(put: Put, tmp_path: Path) -> None:
    engine = "from gaplab.services.engines.analytic import Analytic\n\n\nclass Glide(Analytic):\n    name = 'glide'\n"
    moved = tmp_path / "moved"
    put(glide=f"{engine}\n    def __init__(self):\n        super().__init__()\n")
    assert "Glide in glide.py takes no options" in engines.unusable["glide"]

    put(glide=f"{engine}\n    def __init__(self, options=None):\n        open({str(moved)!r}, 'w').write('it moves')\n")

    assert "glide" in engines
    assert not moved.exists()


@pytest.mark.parametrize("options", [{}, {"lambda": 0.7}])
def test_an_option_with_an_alias_is_stored_by_it_and_runs(put: Put, options: dict[str, Any]) -> None:
    put(careful=ALIAS)

    resolved = resolve_experiment(toy(strategy={"name": "careful", "options": options}))

    stored = resolved.model_dump(mode="json")
    assert stored["strategy"]["options"] == {"lambda": 0.5, **options}
    assert resolved.name == ("careful (lambda 0.7)" if options else "careful")
    assert resolve_experiment(resolved) == spec_of(stored) == resolved
    assert setting(resolved, 0).strategy.options.lambda_ == stored["strategy"]["options"]["lambda"]  # type: ignore[attr-defined]


def test_completed_options_of_gaplabs_own_plug_ins_have_the_names_of_their_fields() -> None:
    for kind in set(REGISTRIES) - {"tunable"}:  # a spec has a label in place of a tunable's options
        for name, plugin in REGISTRIES[kind].items():
            if (kind, name) != ("robot", "imported"):
                found = completed(REGISTRIES[kind], PluginRef(name=name))
                assert found.options == plugin.Options().model_dump(mode="json")


def test_a_plug_in_without_a_docstring_does_not_have_that_of_its_base(put: Put) -> None:
    put(careful=CAREFUL.replace('    """Stays in the middle."""\n\n', ""))

    assert strategies["careful"].describe().summary == ""
    assert strategies["random"].describe().summary.endswith(".")


@pytest.mark.parametrize("place", ["careful.py", "careful/__init__.py", "careful/core.py"])
def test_an_edit_that_keeps_size_and_second_is_imported(put: Put, place: str) -> None:
    file = put() / place
    file.parent.mkdir(exist_ok=True)
    if file.name == "core.py":
        (file.parent / "__init__.py").write_text("from gaplab_plugins.careful.core import Careful\n")
    for weight in ("1.0", "9.0"):
        file.write_text(f"{CAREFUL}\n    weight = {weight}\n")
        os.utime(file, (1_700_000_000, 1_700_000_000))
        put()

        assert getattr(strategies["careful"], "weight", None) == float(weight)

    assert not list(file.parent.rglob("*.pyc"))
    assert re.search("weight = 9.0", file.read_text())
