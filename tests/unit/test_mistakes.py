"""Mistakes that pydantic finds are told in plain words: place, permitted, value."""

import pytest
from pydantic import ValidationError

from gaplab.schemas.mistakes import sentence
from gaplab.schemas.spec import StudySpec


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ({"strategies": []}, "strategies must have at least 1 item, not 0"),
        ({"iterations": "many"}, 'iterations must be a whole number, not "many"'),
        ({"repetitions": 0}, "repetitions must be at least 1, not 0"),
        ({"iterations": 1.5}, "iterations must be a whole number, not 1.5"),
        ({"seed": -1}, "seed must be at least 0, not -1"),
        ({"name": ""}, "name must have at least 1 character, not 0"),
        ({"name": "x" * 201}, "name must have at most 200 characters, not 201"),
        ({"budget": {"preset": "tiny"}}, 'preset must be one of smoke, desk, paper, lean, as_published, not "tiny"'),
        ({"tunables": 5}, "tunables must be a list, not 5"),
        ({"tunables": [5]}, "item 0 of tunables must be a name or an object, not 5"),
        ({"strategies": [3]}, "item 0 of strategies must be a name or an object, not 3"),
        ({"budget": 3}, "budget must be a name or an object, not 3"),
        ({"reality": 3}, "reality must be an object, not 3"),
        ({"robot": {}}, "name is missing"),
        ({"reality": {"parameters": {"restitution": "x"}}}, 'restitution must be a finite number, not "x"'),
        ({"budget": {"reuse_transfer": 1}}, "reuse_transfer must be true or false, not 1"),
    ],
)
def test_each_mistake_names_the_place_what_is_permitted_and_the_value(spec: dict[str, object], words: str) -> None:
    with pytest.raises(ValidationError) as refused:
        StudySpec.model_validate(spec)

    assert words in [sentence(error) for error in refused.value.errors()]


def test_a_long_value_is_cut() -> None:
    with pytest.raises(ValidationError) as refused:
        StudySpec.model_validate({"seed": "7" * 500})

    (error,) = refused.value.errors()
    assert len(sentence(error)) < 120
