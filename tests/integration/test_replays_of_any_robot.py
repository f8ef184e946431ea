"""Replays of a robot with every shape, asked over HTTP."""

from collections.abc import Iterator
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient
from PIL import Image

from gaplab.api.app import create_app
from gaplab.schemas.replays import Replay
from gaplab.services.plugins import watching
from gaplab.services.plugins.folders import VARIABLE
from gaplab.services.store.session import Store
from tests.drawn_robot import FILES, strode


@pytest.fixture
def api(sqlite_store: Store, put: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    monkeypatch.setenv(VARIABLE, str(put(**FILES)))
    monkeypatch.setattr(watching, "LOOK_S", 0)
    app = create_app(sqlite_store)
    watching.reload()
    yield TestClient(app)
    app.state.rollout_process.close()
    app.state.drawing_process.close()


def test_every_part_of_every_body_is_shown(sqlite_store: Store, api: TestClient) -> None:
    experiment = strode(sqlite_store)

    answer = api.get(f"/experiments/{experiment}/replay")

    assert answer.status_code == 200, answer.text
    shown = Replay.model_validate_json(answer.content)
    world = shown.simulation
    assert world is not None
    kinds = [shape.kind for shape in world.shapes if shape.body is not None]
    assert sorted(set(kinds)) == ["box", "capsule", "cylinder", "hull", "sphere"]
    assert (shown.bodies[shown.observed], shown.feet) == ("head", ("left foot", "right foot", "wheel"))
    assert world.slope_rad == 0.12
    assert shown.framing.scale == 1.0
    assert {shape.body for shape in world.shapes if shape.role == "trunk"} == {shown.observed}
    assert {shape.kind for shape in world.shapes if shape.role == "foot"} == {"hull", "cylinder"}


def test_heights_and_speeds_are_those_of_the_observed_body_that_slides(sqlite_store: Store, api: TestClient) -> None:
    experiment = strode(sqlite_store)

    shown = Replay.model_validate_json(api.get(f"/experiments/{experiment}/replay").content)
    figure = api.get(f"/figures/gait?experiment={experiment}&format=json").json()

    assert shown.simulation is not None
    expected = 0.39 + 0.16 + 0.04 * np.sin(4 * np.array(shown.times_s) + 8)
    assert np.allclose(shown.simulation.heights_m, expected, atol=1e-3)
    assert np.mean(shown.simulation.speeds_m_s) == pytest.approx(0.3 * 0.3, rel=0.05)
    assert any("Mean height of head" in row[0] for row in figure["table"]["rows"])


def test_its_video_shows_each_colour(sqlite_store: Store, api: TestClient) -> None:
    experiment = strode(sqlite_store)

    answer = api.get(f"/experiments/{experiment}/video?width=640&format=gif")

    assert answer.status_code == 200, answer.text
    with Image.open(BytesIO(answer.content)) as film:
        frame = np.asarray(film.convert("RGB")).astype(int)
    orange = (frame[..., 0] > 100) & (frame[..., 0] > 1.5 * frame[..., 1]) & (frame[..., 2] < 40)
    blue = (frame[..., 2] > 70) & (frame[..., 0] < 20)
    assert orange.sum() > 20
    assert blue.sum() > 50
