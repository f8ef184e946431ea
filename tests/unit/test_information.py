"""How outcomes depend on the tunables."""

import numpy as np

from gaplab.services.core.scoring import beside, fisher_information, log_determinant, moved, trace
from gaplab.services.core.space import Space

SPACE = Space.box([0.0, -2.0], [1.0, 2.0])


def test_steps_are_shares_of_the_bounds_and_turn_around_at_them() -> None:
    parameters = np.array([[0.5, 0.0], [0.95, -1.9]])

    np.testing.assert_allclose(moved(parameters, np.array([0.1, -0.1]), SPACE), [[0.6, -0.4], [0.85, -1.5]])
    np.testing.assert_allclose(beside(parameters[1], 0.1, SPACE), [[0.85, -1.9], [0.95, -1.5]])


def test_information_is_that_of_the_slopes_per_extent_whichever_way_the_steps_go() -> None:
    slopes = np.array([[3.0, 0.0, 1.0], [-1.0, 2.0, 0.0]])
    for place in ([0.5, 0.0], [0.95, 1.9]):
        parameters = np.vstack([place, beside(np.array(place), 0.1, SPACE)])
        outcomes = ((parameters - SPACE.lower) / SPACE.extent) @ slopes

        found = fisher_information(outcomes[None], parameters, SPACE)

        np.testing.assert_allclose(found[0], slopes @ slopes.T)


def test_the_trace_favours_a_loud_tunable_and_the_determinant_both() -> None:
    loud, both = np.diag([100.0, 0.0]), np.diag([40.0, 40.0])
    information = np.array([loud, both])

    assert trace(information).argmax() == 0
    assert log_determinant(information).argmax() == 1
    assert np.isnan(log_determinant(np.full((1, 2, 2), np.nan)))[0]
