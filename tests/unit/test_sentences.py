"""Numbers as they are written, and events and steps as sentences."""

from typing import Any

import pytest

from gaplab.schemas.events import EventKind
from gaplab.services.findings import wording
from gaplab.services.findings.event_sentences import SENTENCES, event_sentence, step_sentence


def test_numbers_have_three_digits_and_a_small_one_is_not_0() -> None:
    values = (None, 0.0, -0.0, 0.5, -0.0012345, 999.7, 12345.6, 1e-7)

    assert [wording.number(each) for each in values] == ["–", "0", "0", "0.5", "−0.00123", "1000", "12346", "1e−07"]
    assert [wording.signed(each) for each in (None, 0.0, 1.234, -0.5)] == ["–", "0", "+1.23", "−0.5"]


def test_intervals_spreads_and_shares_are_written_as_in_papers() -> None:
    assert wording.estimate(0.00123, 0.00119, 0.00127) == "0.00123 [0.00119, 0.00127]"
    assert wording.estimate(0.75, 0.5, None) == "0.75"
    assert wording.interval(-0.2, 0.1, wording.signed) == "95 % interval −0.2 to +0.1"
    assert [wording.spread(0.5, 0.1), wording.spread(0.5, None), wording.spread(None, None)] == [
        "0.5 ± 0.1",
        "0.5",
        "–",
    ]
    assert [wording.share(each) for each in (None, 0.666)] == ["–", "67 %"]


def test_p_after_holm_comes_first_and_the_raw_p_beside_it() -> None:
    assert [wording.probability(each) for each in (None, 0.0009, 0.001, 0.25)] == ["–", "< 0.001", "0.001", "0.250"]
    assert wording.probabilities(0.01, 0.03) == "0.030 (raw 0.010)"
    assert wording.probabilities(None, None) == "–"
    assert [wording.p_in_words(0.01, 0.03), wording.p_in_words(1e-5, 1e-4)] == [
        "p = 0.030, raw 0.010",
        "p < 0.001, raw < 0.001",
    ]


def test_every_kind_of_event_has_its_sentence() -> None:
    assert set(SENTENCES) == set(EventKind)


AT = {"iteration": 2, "operator": "Ada"}
WET = {**AT, "by": "Bea", "reason": "it was wet"}


@pytest.mark.parametrize(
    ("kind", "body", "sentence"),
    [
        ("repetition_failed", {"reason": "a foot fell off"}, "Repetition 3 failed: a foot fell off"),
        ("measured", {**AT, "fitness": None}, "Repetition 3, iteration 2: failed in reality"),
        (
            "probed",
            {**AT, "left_out": True},
            "Repetition 3, iteration 2: the controller is not measured, as the spec says",
        ),
        ("probed", {**AT, "fitness": 0.5}, "Repetition 3, iteration 2: the controller reaches 0.5 in reality"),
        (
            "requested",
            {**AT, "kind": "probe"},
            "Repetition 3, iteration 2: a measurement of the transferred controller is requested",
        ),
        ("voided", WET, "Repetition 3, iteration 2: the measurement by Ada is void, says Bea: it was wet"),
        ("voided", {**WET, "by": None}, "Repetition 3, iteration 2: the measurement by Ada is void: it was wet"),
        ("corrected", WET, "Repetition 3, iteration 2: the measurement by Ada was corrected by Bea: it was wet"),
        ("decided", WET, "Repetition 3, iteration 2: Bea decided about the answer by Ada: it was wet"),
        (
            "transferred",
            {**AT, "simulated_fitness": None},
            "Repetition 3, iteration 2: controller evolved, the physics failed in simulation",
        ),
        (
            "tuned",
            {**AT, "squared_error": 1e-5},
            "Repetition 3, iteration 2: simulators tuned, sum of squared errors 1e−05",
        ),
        ("submitted", {"repetitions": 1200}, "Submitted, with 1,200 repetitions"),
        ("submitted", {"repetitions": "many"}, "submitted"),
        ("edited", {"fields": ["add_tags"], "add_tags": ["gait", "wet"]}, "Edited: added the tags gait, wet"),
        ("edited", {"fields": ["name", "tags"], "remove_tags": ["wet"]}, "Edited: name; removed the tag wet"),
        ("edited", {"fields": ["tags"], "tags": ["a_b"]}, "Edited: set the tag a_b"),
        ("edited", {"fields": ["name", "remove_tags"]}, "Edited: name, remove tags"),
    ],
)
def test_an_event_is_a_sentence(kind: str, body: dict[str, Any], sentence: str) -> None:
    assert event_sentence(EventKind(kind), 3, body) == sentence


def test_steps_of_a_closed_branch_are_told_as_their_events_with_the_repeats() -> None:
    measured = {"kind": "measured", "iteration": 2, "genome": [1], "fitness": 0.5, "repeats": [0.4, 0.6]}
    tuned = {"kind": "tuned", "iteration": 2, "simulators": [{"parameters": [1], "squared_error": 0.25}]}

    assert step_sentence(measured, 1) == "Repetition 1, iteration 2: measured in reality, 0.5 (0.4, 0.6)"
    assert step_sentence(tuned, 1) == "Repetition 1, iteration 2: simulators tuned, sum of squared errors 0.25"
