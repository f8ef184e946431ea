"""Bodies of requests: values of NumPy are sent as numbers, and what JSON cannot hold is refused before it is sent."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from gaplab import Client
from gaplab.api.clients.bodies import json_of, numbers_of, readings_of


def test_numbers_and_arrays_of_numpy_become_those_of_python() -> None:
    body = {
        "seed": np.int64(3),
        "values": np.array([0.5, 0.25], dtype=np.float32),
        "tables": [np.ones((1, 2)), ((0, None),)],
        "yes": np.bool_(True),
        "name": "a",
    }

    found = json_of(body)

    expected = {"seed": 3, "values": [0.5, 0.25], "tables": [[[1.0, 1.0]], [[0, None]]], "yes": True, "name": "a"}
    assert json.loads(json.dumps(found)) == found == expected


@pytest.mark.parametrize(
    ("body", "error", "said"),
    [
        ({"values": [0.1, float("nan")]}, ValueError, r"^/values/1: must be a finite number, not nan$"),
        (
            {"spec": {"rates": np.array([1.0, np.inf])}},
            ValueError,
            r"^/spec/rates/1: must be a finite number, not inf$",
        ),
        ({"file": Path("a1.urdf")}, TypeError, r"^/file: must be text, .*, not PosixPath\('a1.urdf'\)$"),
        ({"tunables": {"mass"}}, TypeError, r"^/tunables: must be .* a list .*, not \{'mass'\}$"),
        ({"spec": {1: 2}}, TypeError, r"^/spec: names must be text, not 1$"),
        (1j, TypeError, r"^\(the whole\): must be .*, not 1j$"),
    ],
)
def test_what_json_cannot_hold_is_refused_with_its_place(body: Any, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        json_of(body)


@pytest.mark.parametrize(
    "values", [0.5, np.float32(0.5), [0.5], (0.5,), np.array([0.5]), {"a": 0.5}.values(), iter([0.5])]
)
def test_values_may_be_in_whatever_holds_them(values: Any) -> None:
    assert numbers_of(values, "/values") == [0.5]


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ("0.5", "^/values: must be a number or a list of numbers, not '0.5'$"),
        (None, "^/values: must be a number or a list of numbers, not None$"),
        ({"a": 0.5}, "^/values: must be a number or a list of numbers, not {'a': 0.5}$"),
        ([0.5, None], "^/values/1: must be a number, not None$"),
        (True, "^/values/0: must be a number, not True$"),
        (np.array([[0.5]]), r"^/values/0: must be a number, not \[0.5\]$"),
    ],
)
def test_what_is_no_number_is_refused(values: Any, said: str) -> None:
    with pytest.raises(TypeError, match=said):
        numbers_of(values, "/values")


def test_a_client_refuses_it_before_anything_is_sent() -> None:
    wrong: Any = np.array([np.nan])
    with (
        Client("http://127.0.0.1:9") as client,
        pytest.raises(ValueError, match=r"^/values/0: must be a finite number"),
    ):
        client.bench.answer("r1", wrong)


def test_a_reading_that_is_nan_is_one_of_a_sensor_that_failed() -> None:
    table = np.array([[0.5, np.nan], [0.25, 1.0]], dtype=np.float32)

    expected = [[0.5, None], [0.25, 1.0]]
    assert readings_of([table, pd.DataFrame(table), [[None, float("nan")]]]) == [expected, expected, [[None, None]]]
