"""What each controller computes: its equation, and what its options change."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract import robots as contract
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.engines import engines
from gaplab.services.specs.robots import Driven, robot_of
from gaplab.services.world.controllers import controllers
from gaplab.services.world.controllers.mlp import Mlp
from gaplab.services.world.controllers.oscillators import Sine
from gaplab.services.world.controllers.parts import Limbs, middles, weighted
from gaplab.services.world.controllers.plastic import Plastic
from gaplab.services.world.kinematics import about, inverse, product, rotated
from gaplab.services.world.motions import Motion
from gaplab.services.world.robots.quadruped import Quadruped

OBSERVE_S = np.array([0.5, 3.0])
WORLD = Quadruped().world
SWINGS = np.array([joint.swing for joint in WORLD.actuators])


def prepared(name: str, world: Any = WORLD, **options: Any) -> Any:
    controller = controllers.create(PluginRef(name=name, options=options))
    controller.prepare(world, OBSERVE_S)
    return controller


def acted(controller: Any, genome: Any, observations: Any, memory: Any = None, time_s: float = 0.0) -> Any:
    first = controller.motion(genome).memory if memory is None else memory
    targets, memory = controller.act(genome[None], np.array([observations]), first[None], time_s)
    return targets[0], memory[0]


def test_pulses_too_short_for_a_motion_to_fit_into_memory_are_refused() -> None:
    controller = controllers.create(PluginRef(name="square_pulses", options={"period_s": 0.001}))
    told = "^/controller/options/period_s: 0.001 s is too short for motions of 600 s with 12 actuators"

    with pytest.raises(InvalidSpec, match=told) as refused:
        controller.prepare(WORLD, np.array([600.0]))

    assert refused.value.violations[0].permitted == "at least 0.0173 s, or a shorter motion"
    controllers.create(PluginRef(name="square_pulses", options={"period_s": 0.0174})).prepare(WORLD, np.array([600.0]))


def test_a_sine_has_its_frequency_amplitudes_phases_and_offsets() -> None:
    controller = prepared("sine", slowest_hz=1.0, fastest_hz=3.0)
    genome = np.zeros(controller.space.size)
    genome[0], genome[1:4] = 0.5, (0.8, 0.25, -0.5)

    motion = controller.motion(genome)

    expected = SWINGS[0] * (-0.5 + 0.8 * np.sin(2 * np.pi * (2.0 * motion.times_s + 0.25)))
    np.testing.assert_allclose(motion.targets[:, 0], expected, atol=1e-12)
    assert not motion.targets[:, 1:].any()
    assert motion.times_s[-1] == pytest.approx(2.98)


def test_targets_of_speeds_and_torques_have_their_middle_at_zero_and_angles_at_the_joints_start() -> None:
    arm = contract.arm()
    controller = prepared("sine", arm)
    genome = np.zeros(controller.space.size)

    assert controller.motion(genome).targets[0].tolist() == [0.3, 0.0, 0.0]


@pytest.mark.parametrize(
    ("gait", "phases"),
    [
        ("trot", [0.5, 0.0, 0.0, 0.5]),
        ("pace", [0.0, 0.5, 0.0, 0.5]),
        ("bound", [0.5, 0.5, 0.0, 0.0]),
        ("walk", [0.25, 0.75, 0.0, 0.5]),
    ],
)
def test_a_gait_gives_each_leg_its_phase(gait: Any, phases: Any) -> None:
    limbs = Limbs.of(WORLD)  # front left, front right, rear left, rear right

    assert limbs.phases(gait).tolist() == phases
    assert limbs.limb.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert limbs.depth.tolist() == [0, 1, 2] * 4


def reframed(world: Any, turn: Any) -> Any:
    """The same robot, the frame of whose base is turned by `turn` at the start."""
    back = inverse(np.array(turn))
    joints = tuple(
        replace(
            joint,
            origin_m=tuple(rotated(back, np.array(joint.origin_m))),
            turn=tuple(product(back, np.array(joint.turn))),
        )
        if joint.parent == world.bodies[0].name
        else joint
        for joint in world.joints
    )
    return replace(world, joints=joints, start_turn=turn)


def test_limbs_of_a_robot_do_not_depend_on_the_frame_of_its_base() -> None:
    turn = tuple(about(np.array([0.6, 0.0, 0.8]), np.array([1.9]))[0])
    plain, turned = Limbs.of(WORLD), Limbs.of(reframed(WORLD, turn))

    assert turned.places_m == pytest.approx(plain.places_m, abs=1e-12)
    assert turned.upward == pytest.approx(plain.upward, abs=1e-12)
    for gait in ("trot", "pace", "bound", "walk"):
        assert np.array_equal(turned.phases(gait), plain.phases(gait))


def test_an_anticipating_robot_keeps_its_heading_in_any_frame_of_its_base() -> None:
    turn = tuple(about(np.array([1.0, 0.0, 0.0]), np.array([np.pi / 2]))[0])
    spin = np.array([0.1, -0.2, 0.7])
    targets = []
    for world, seen in ((WORLD, spin), (reframed(WORLD, turn), rotated(inverse(np.array(turn)), spin))):
        controller = prepared("anticipating", world)
        observed = [*middles(world), *seen]
        _, memory = acted(controller, controller.known, observed)
        targets.append(acted(controller, controller.known, observed, memory, 0.02)[0])

    assert targets[1] == pytest.approx(targets[0], abs=1e-12)


def test_a_cpg_grows_from_its_middle_to_the_genomes_amplitude() -> None:
    controller = prepared("cpg", convergence_hz=40.0)
    targets = controller.motion(controller.known).targets

    assert not targets[0].any()
    late = targets[len(targets) // 2 :]
    np.testing.assert_allclose(np.abs(late).max(axis=0), 0.5 * SWINGS, rtol=0.02)


def test_the_joints_of_a_gait_move_in_its_phases() -> None:
    controller = prepared("cpg", gait="trot")
    targets = controller.motion(controller.known).targets / SWINGS

    np.testing.assert_allclose(targets[:, 0:3], targets[:, 9:12], atol=1e-12)  # diagonal legs
    np.testing.assert_allclose(targets[:, 0:3], -targets[:, 3:6], atol=1e-12)  # neighbours
    assert controller.space.size == 1 + 3 + 24


def test_coupling_pulls_oscillators_of_different_frequencies_into_step() -> None:
    rng = np.random.default_rng(3)
    apart, locked = (prepared("cpg", frequencies="own", coupling_hz=coupling) for coupling in (0.0, 20.0))
    genome = apart.known.copy()
    genome[:12] = 0.5 + 0.1 * rng.normal(size=12)
    speeds = 2 * np.pi * (0.5 + 2.5 * genome[:12])

    free, coupled = (each._advances(speeds) for each in (apart, locked))

    np.testing.assert_allclose(free[-1], speeds * 2.98, rtol=1e-9)
    assert np.ptp(coupled[-1]) < np.ptp(free[-1]) / 10
    assert coupled[-1].mean() == pytest.approx(free[-1].mean(), rel=0.01)


def test_one_frequency_is_the_limit_of_equal_own_frequencies() -> None:
    common, own = prepared("cpg"), prepared("cpg", frequencies="own")
    genome = common.space.draw(1, np.random.default_rng(0))[0]

    motions = [common.motion(genome), own.motion(np.concatenate([np.full(12, genome[0]), genome[1:]]))]

    np.testing.assert_allclose(motions[0].targets, motions[1].targets, atol=1e-9)


def test_a_network_is_its_formula() -> None:
    controller = prepared("mlp", senses="turning", hidden=3, clock_s=0.8, weight=1.5)
    genome = controller.space.draw(1, np.random.default_rng(5))[0]
    turning = np.array([0.4, -2.0, 1.0])

    targets, _ = acted(controller, genome, turning, time_s=0.3)

    angle = 2 * np.pi * 0.3 / 0.8
    inner, outer = 1.5 * genome[:18].reshape(3, 6), 1.5 * genome[18:].reshape(12, 4)
    hidden = np.tanh(inner @ [*(turning / 5.0), np.sin(angle), np.cos(angle), 1.0])
    np.testing.assert_allclose(targets, SWINGS * np.tanh(outer @ [*hidden, 1.0]), rtol=1e-12)


def test_senses_are_ordered_and_unknown_ones_are_refused() -> None:
    assert prepared("mlp", senses="tilt, angles").options.senses == ("angles", "tilt")
    with pytest.raises(InvalidSpec, match="unknown group of observations 'smell'; permitted: angles, speeds"):
        prepared("mlp", senses="smell")


def plastic_weights(controller: Any, memory: Any) -> Any:
    return memory[: -controller._neurons].reshape(controller._neurons, controller._inputs)


@pytest.mark.parametrize("rule", range(4))
def test_weights_change_by_the_rule_of_their_neuron_every_tenth_of_a_second(rule: int) -> None:
    controller = prepared("plastic", base="none", senses="tilt")
    genome = controller.known.copy()
    genome[1:36:3], genome[2:36:3] = (rule + 0.5) / 4, 0.6  # a rate of two thirds
    memory = controller.motion(genome).memory
    tilt = np.array([0.3, -0.2, -0.9])

    _, kept = acted(controller, genome, tilt, memory, 0.08)
    _, learned = acted(controller, genome, tilt, memory, 0.1)

    weights, after = plastic_weights(controller, memory), kept[-12:]
    x, y = np.array([*[0.5] * 12, *(1 + np.tanh(tilt)) / 2]), after[:, None]
    covariance = np.tanh(4 * (1 - np.abs(x - y)) - 2)
    change = (
        (1 - weights) * x * y,
        weights * (x - 1) * y + (1 - weights) * x * y,
        weights * x * (y - 1) + (1 - weights) * x * y,
        np.where(covariance > 0, 1 - weights, weights) * covariance,
    )[rule]
    np.testing.assert_array_equal(plastic_weights(controller, kept), weights)
    np.testing.assert_allclose(plastic_weights(controller, learned), weights + 2 / 3 * change, rtol=1e-12)


def test_weights_stay_between_0_and_1_and_start_small_by_the_genome() -> None:
    controller = prepared("plastic")
    rng = np.random.default_rng(0)
    genomes = controller.space.draw(16, rng)
    memories = np.array([controller.motion(genome).memory for genome in genomes])
    first = memories[:, : -controller._neurons]
    assert first.max() < 0.1
    assert len(np.unique(first[:, 0])) == len(genomes)

    for tick in range(200):
        _, memories = controller.act(genomes, rng.normal(size=(16, 12 + 3 + 4)), memories, tick * 0.02)

    weights = memories[:, : -controller._neurons]
    assert 0.0 <= weights.min() <= weights.max() <= 1.0
    assert weights.max() > 0.5  # they have learned


def test_a_negative_sign_inhibits() -> None:
    controller = prepared("plastic", base="none", senses="tilt")
    excited, inhibited = controller.known.copy(), controller.known.copy()
    excited[0:36:3], inhibited[0:36:3] = 1.0, 0.0
    inhibited[36:] = 0.0
    memory = controller.motion(excited).memory

    high, low = (acted(controller, genome, np.zeros(3), memory)[0] for genome in (excited, inhibited))

    assert (high > 0).all()
    np.testing.assert_allclose(high, -low, rtol=1e-9)


def test_an_anticipating_robot_pushes_against_what_it_did_not_expect() -> None:
    controller = prepared("anticipating", gain=0.5, heading_gain=0.4, lag_s=0.05)
    genome = controller.known
    pulses = controller._pulses.targets(genome[None], 0.2)[0]
    memory = np.array([*np.full(12, 0.1), 0.3])

    as_expected, later = acted(controller, genome, [*np.full(12, 0.1), 0.0, 0.0, 2.0], memory, 0.2)
    pushed, _ = acted(controller, genome, [*np.full(12, 0.3), 0.0, 0.0, 0.0], memory, 0.2)

    np.testing.assert_allclose(pushed - as_expected, -0.5 * 0.2)
    turned_back = as_expected - pulses  # yaws are upright: axes down on the left, up on the right
    np.testing.assert_allclose(turned_back, 0.4 * 0.3 * np.array([1, 0, 0, -1, 0, 0, 1, 0, 0, -1, 0, 0]), atol=1e-12)
    assert later[-1] == pytest.approx(0.3 + 0.02 * 2.0)
    np.testing.assert_allclose(later[:12], 0.1 + (1 - np.exp(-0.4)) * (pulses - 0.1))


def test_pulses_in_a_loop_are_those_of_square_pulses() -> None:
    genome = Quadruped().known
    looped, pulses = prepared("anticipating", gain=0.0, heading_gain=0.0), prepared("square_pulses")
    motion = pulses.motion(genome)

    for time_s in np.arange(0.013, 2.9, 0.05):
        now = motion.targets[np.searchsorted(motion.times_s, time_s, side="right") - 1]
        np.testing.assert_array_equal(looped._pulses.targets(genome[None], time_s)[0], now)


class Leaky(Mlp):
    """A network that breaks its promise: its loops see one another."""

    name = "leaky"

    def act(self, genomes: Any, observations: Any, memory: Any, time_s: float) -> Any:
        targets, memory = super().act(genomes, observations, memory, time_s)
        return targets + 1e-15 * targets.sum(), memory


class Late(Sine):
    """A sine whose targets do not begin at 0."""

    name = "late"

    def motion(self, genome: Any) -> Motion:
        motion = super().motion(genome)
        return Motion(motion.times_s + 1.0, motion.targets, motion.observe_s)


class Drawn(Plastic):
    """A network whose first weights differ at each call."""

    name = "drawn"

    def motion(self, genome: Any) -> Any:
        return super().motion(genome + np.random.default_rng().random())


@pytest.mark.parametrize(
    ("plugin", "check", "why"),
    [
        (Leaky, contract.acts_on_each_row_alone, "the first 1 differ from 1 alone"),
        (Late, contract.drives_every_actuator, "times_s begin at 1.0"),
        (Drawn, contract.repeats_itself, "the motion of a genome differs when it is asked again"),
    ],
)
def test_the_contract_finds_a_controller_that_breaks_it(plugin: Any, check: Any, why: str) -> None:
    with pytest.raises(AssertionError, match=why):
        check(plugin)


def test_weighted_sums_keep_their_bits_however_many_rows_there_are() -> None:
    rng = np.random.default_rng(0)
    for outputs, inputs in ((1, 1), (1, 9), (5, 8), (12, 27), (3, 300)):
        weights, values = rng.normal(size=(64, outputs, inputs)), rng.normal(size=(64, inputs))
        whole = weighted(weights, values)
        np.testing.assert_allclose(whole, np.einsum("noi,ni->no", weights, values), rtol=1e-9, atol=1e-12)
        for count in (1, 2, 7):
            np.testing.assert_array_equal(weighted(weights[:count], values[:count]), whole[:count])


@pytest.mark.parametrize("name", ["sine", "cpg", "mlp", "plastic", "anticipating"])
def test_each_controller_drives_the_quadruped_and_moves_it(name: str) -> None:
    robot = robot_of(Driven(PluginRef(name="quadruped"), PluginRef(name=name)))
    engine = engines.create(PluginRef(name="pybullet"))

    first, again = (engine.rollout(robot.world, robot.motion(robot.known)) for _ in range(2))

    assert float(robot.fitness(first)) > 0.005
    np.testing.assert_array_equal(first.positions_m, again.positions_m)
