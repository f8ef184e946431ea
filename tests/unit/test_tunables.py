"""Tunables by path: labels, what they edit, what is refused, and what a spec stores."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import TunableRef
from gaplab.schemas.sensitivity import SensitivitySpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.contract.robots import arm
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.registry import listed
from gaplab.services.core.space import Space
from gaplab.services.core.strategies.untuned import NoiseEnvelope, NoiseEnvelopeOptions
from gaplab.services.engines.analytic import Analytic
from gaplab.services.plugins.external import named_in
from gaplab.services.specs import resolution
from gaplab.services.specs.assembly import edits_of
from gaplab.services.specs.resolution import resolve, resolve_experiment, resolve_sensitivity
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.inertias import inertia_of
from gaplab.services.world.kinematics import body_poses, clearances_m
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.robots.robot_file import usual_tunables
from gaplab.services.world.tunables.base import Tunable, matching
from gaplab.services.world.tunables.labels import label_of, proper, tunable_of, unit_of
from gaplab.services.world.world import Box, Inertia, Material, Noise, PDMotor, Sphere

WORLD = Quadruped().world


def resolved(**fields: Any) -> Any:
    return resolve_experiment(ExperimentSpec.model_validate({"strategy": "random", "engine": "mujoco", **fields}))


def refusals(**fields: Any) -> Any:
    with pytest.raises(InvalidSpec) as raised:
        resolved(**fields)
    return {each.pointer: each for each in raised.value.violations}


def edited(label: str, value: float, world: Any = WORLD) -> Any:
    return tunable_of(label).edit(world, value)


def body(world: Any, name: str) -> Any:
    return next(each for each in world.bodies if each.name == name)


@pytest.mark.parametrize(
    ("spelling", "label"),
    [
        ("mass(trunk)", "mass(trunk)"),
        (" mass ( trunk ) ", "mass(trunk)"),
        ("mass(of=trunk, as=scale)", "mass(trunk)"),
        ("mass", "mass"),
        ("mass(*)", "mass"),
        ("mass(trunk,as=value)", "mass(trunk, as=value)"),
        ("length_scale(*_shin, what=places)", "length_scale(*_shin, what=places)"),
        ("dynamic_friction", "dynamic_friction"),
        ("dynamic_friction(rubber)", "dynamic_friction(rubber)"),
    ],
)
def test_equal_tunables_have_one_label(spelling: str, label: str) -> None:
    assert proper(spelling) == label
    assert label_of(tunable_of(label)) == label


def test_options_of_a_tunable_become_its_label_and_a_stored_spec_has_no_more_fields_than_before() -> None:
    ref = TunableRef.model_validate({"name": "mass", "options": {"of": "trunk", "as": "value"}, "lower": 1.0})

    assert ref.model_dump() == {"name": "mass(trunk, as=value)", "lower": 1.0, "upper": None}
    assert TunableRef.model_validate({"name": "mass", "options": {}}).name == "mass"
    assert TunableRef.model_validate("mass(trunk)").name == "mass(trunk)"
    schema = TunableRef.model_json_schema()
    assert set(schema["anyOf"][1]["properties"]) == {"name", "lower", "upper", "options"}


def test_labels_are_separated_by_commas_outside_parentheses() -> None:
    assert listed("mass(trunk, as=value), slope,") == ["mass(trunk, as=value)", "slope"]


def test_a_resolved_spec_has_proper_labels_and_reality_has_the_nominal_values() -> None:
    labels = ["mass(of=trunk)", "mass(*_shin, as=value)", "slope", "noise(start_tilt_rad)", "center_of_mass(trunk)"]
    spec = resolved(tunables=labels, reality={"parameters": {"mass( trunk )": 1.1}})

    assert [ref.name for ref in spec.tunables] == ["mass(trunk)", *labels[1:]]
    assert (spec.tunables[0].lower, spec.tunables[0].upper) == (0.7, 1.3)
    assert (spec.tunables[1].lower, spec.tunables[1].upper) == pytest.approx((0.7 * 0.15, 1.3 * 0.15))
    assert spec.reality.parameters == {
        "mass(trunk)": 1.1,
        "mass(*_shin, as=value)": 0.15,
        "slope": 0.0,
        "noise(start_tilt_rad)": 0.0,
        "center_of_mass(trunk)": 0.0,
    }
    assert resolve_experiment(ExperimentSpec.model_validate(spec.model_dump(mode="json"))) == spec
    assert "tunable mass" in named_in(spec.model_dump(mode="json"))
    assert not any("(" in plugin for plugin in named_in(spec.model_dump(mode="json")))


def test_a_group_of_unequal_parts_leaves_reality_as_the_robot_is() -> None:
    spec = resolved(tunables=["mass(*, as=value)", "slope"])

    assert spec.reality.parameters == {"slope": 0.0}
    assert resolved(
        tunables=["mass(*, as=value)"], reality={"parameters": {"mass(*, as=value)": 0.5}}
    ).reality.parameters


def test_plain_tunables_are_stored_with_their_names_and_bounds_alone() -> None:
    stored = resolved().model_dump(mode="json")

    assert stored["tunables"] == [
        {"name": "static_friction", "lower": 0.0, "upper": 1.5},
        {"name": "dynamic_friction", "lower": 0.0, "upper": 1.5},
        {"name": "restitution", "lower": 0.0, "upper": 0.6},
    ]


def test_parts_that_the_robot_lacks_are_refused_with_the_permitted_names() -> None:
    found = refusals(
        tunables=["mass(trnk)", "kp", "joint_damping(*_toe)", "static_friction(rubber)"],
        reality={"parameters": {"mass(trunc)": 1.0}},
    )

    assert "did you mean 'trunk'?" in found["/tunables/0"].message
    assert found["/tunables/0"].permitted == tuple(each.name for each in WORLD.bodies)
    assert "the robot has none" in found["/tunables/1"].message
    assert found["/tunables/2"].permitted == tuple(each.name for each in WORLD.joints)
    assert "matches no surface" in found["/tunables/3"].message
    assert "matches no body" in found["/reality/parameters/mass(trunc)"].message


@pytest.mark.parametrize(
    ("label", "why"),
    [
        ("mas(trunk)", r"unknown tunable 'mas' \(did you mean 'mass'\?\)"),
        ("mass(trunk", "is not a label of a tunable; write name"),
        ("mass(trunk)x", "is not a label of a tunable"),
        ("mass(trunk, left)", "'left' in 'mass\\(trunk, left\\)' has no name; write option=value"),
        ("mass(trunk, az=value)", "unknown option of 'mass' 'az'.*permitted: of, as"),
        ("mass(trunk, as=scales)", "as must be one of scale, value"),
        ("noise(smell)", "of must be one of target, angle_rad"),
    ],
)
def test_wrong_labels_are_refused_with_the_reason(label: str, why: str) -> None:
    with pytest.raises(InvalidSpec, match=why):
        resolved(tunables=[label])


@pytest.mark.parametrize("label", ["", " ", "a" * 101])
def test_a_hidden_parameter_needs_the_name_of_a_tunable(label: str) -> None:
    found = refusals(reality={"parameters": {label: 0.5}})

    assert "unknown tunable" in found[f"/reality/parameters/{label}"].message


def test_a_tunable_in_two_spellings_is_there_twice() -> None:
    found = refusals(tunables=["mass(trunk)", "mass(trunk, as=scale)"])

    assert set(found) == {"/tunables/0", "/tunables/1"}
    assert "is named 2 times" in found["/tunables/1"].message


def test_a_value_out_of_range_is_told_with_its_label() -> None:
    found = refusals(tunables=[{"name": "mass(trunk)", "upper": 1000.0}])

    assert "mass(trunk) must be from 0.01 to 100" in found["/tunables/0/upper"].message


def test_masses_scale_with_their_inertia() -> None:
    stated = replace(WORLD, bodies=(replace(WORLD.bodies[0], inertia=Inertia((1.0, 2.0, 3.0))), *WORLD.bodies[1:]))

    heavy, legs = edited("mass(trunk)", 1.2, stated), edited("mass(*_shin, as=value)", 0.2, stated)

    assert body(heavy, "trunk").mass_kg == pytest.approx(1.8)
    assert body(heavy, "trunk").inertia.moments_kg_m2 == pytest.approx((1.2, 2.4, 3.6))
    assert heavy.bodies[1:] == stated.bodies[1:]
    assert heavy.edits == {"body.mass_kg", "body.inertia"}
    assert edited("mass", 2.0).edits == {"body.mass_kg"}
    assert {body(legs, f"{leg}_shin").mass_kg for leg in ("front_left", "rear_right")} == {0.2}
    assert body(legs, "trunk") == body(stated, "trunk")


def test_a_factor_of_one_leaves_stated_inertias_to_the_bit() -> None:
    moments = (0.8369, 0.8105, 0.0986)
    bodies = tuple(replace(each, mass_kg=0.7, inertia=Inertia(moments)) for each in WORLD.bodies)
    stated = replace(WORLD, bodies=bodies)

    assert tunable_of("mass").edit(stated, 1.0) == stated


def test_numbers_of_joints_and_motors_are_those_of_the_pattern() -> None:
    world = edited("joint_damping(*_knee)", 0.3)
    assert [joint.damping for joint in world.joints] == [0.0, 0.0, 0.3] * 4
    assert [joint.motor.max_torque_nm for joint in edited("max_torque(front_*)", 0.5).joints] == [4.0] * 6 + [8.0] * 6
    assert {joint.motor.position_gain for joint in edited("motor_gain(*, as=value)", 0.1).joints} == {0.1}

    stiff = edited("kp", 2.0, arm())
    assert [joint.motor.kp for joint in stiff.joints] == [100.0, 0.0, 0.0]
    assert [joint.motor.delay_s for joint in edited("delay(joint_1)", 0.03, arm()).joints] == [0.0, 0.03, 0.0]


@pytest.mark.parametrize(("name", "follows"), [("kp", {"position"}), ("kd", {"position", "velocity"})])
def test_a_gain_is_of_the_motors_whose_torque_depends_on_it(name: str, follows: set[str]) -> None:
    kinds = {kind: PDMotor(kind, 8.0, kp=100.0, kd=100.0) for kind in ("position", "velocity", "torque")}  # type: ignore[arg-type]
    one = WORLD.joints[0]
    mixed = replace(
        WORLD, joints=(*(replace(one, name=kind, motor=motor) for kind, motor in kinds.items()), *WORLD.joints[3:])
    )

    changed = tunable_of(f"{name}(*, as=value)").edit(mixed, 50.0)

    motors = [joint.motor for joint in changed.joints if isinstance(joint.motor, PDMotor)]
    assert {motor.follows for motor in motors if getattr(motor, name) == 50.0} == follows
    torque = replace(WORLD, joints=tuple(replace(joint, motor=kinds["torque"]) for joint in WORLD.joints))
    assert tunable_of(name).lack(torque) is not None


def test_friction_of_a_surface_leaves_the_ground() -> None:
    world = replace(WORLD, surfaces=(("rubber", Material(0.9, 0.7)), ("steel", Material(0.2, 0.1))))

    slippery = edited("static_friction(rubber)", 0.4, world)

    assert slippery.surfaces == (("rubber", Material(0.4, 0.7)), ("steel", Material(0.2, 0.1)))
    assert slippery.material == world.material
    assert tunable_of("static_friction(*)").read(world) == pytest.approx(0.55)
    assert tunable_of("static_friction(rubber)").field == "surfaces"


def test_a_shifted_centre_of_mass_leaves_the_shape_and_all_shifts_share_what_engines_build() -> None:
    ahead, up = edited("center_of_mass(trunk)", 0.03), edited("center_of_mass(trunk, along=z)", -0.01)
    trunk = body(ahead, "trunk")

    assert trunk.center_m == (0.03, 0.0, 0.0)
    assert [(part.shape, part.center_m) for part in trunk.parts] == [(Box((0.30, 0.20, 0.06)), (0.0, 0.0, 0.0))]
    assert trunk.inertia == inertia_of(body(WORLD, "trunk"))
    assert body(up, "trunk").center_m == (0.0, 0.0, -0.01)
    shared = {ahead.built(frozenset({"body.center_m"})), up.built(frozenset({"body.center_m"}))}
    assert len(shared) == 1


def lowest_m(world: Any) -> float:
    pose = np.array([[0.0, 0.0, world.start_height_m, *world.start_turn]])
    positions, turns = body_poses(world, pose, np.zeros((1, len(world.joints))))
    return min(float(clearances_m(each, positions[:, k], turns[:, k])[0]) for k, each in enumerate(world.bodies))


@pytest.mark.parametrize(
    ("label", "shin_m", "foot_m"),
    [
        ("length_scale(*_shin)", 1.1, 1.1),
        ("length_scale(*_shin, what=places)", 1.1, 1.0),
        ("length_scale(*_shin, what=shapes)", 1.0, 1.1),
    ],
)
def test_dimensions_scale_and_the_feet_start_on_the_ground(label: str, shin_m: float, foot_m: float) -> None:
    world = edited(label, 1.1)
    shin = body(world, "rear_left_shin")

    assert shin.center_m[2] == pytest.approx(-0.15 * shin_m)
    assert isinstance(shin.shape, Sphere)
    assert shin.shape.radius_m == pytest.approx(0.025 * foot_m)
    assert lowest_m(world) == pytest.approx(lowest_m(WORLD), abs=1e-12)
    assert shin.mass_kg == 0.15


def test_a_longer_link_moves_the_joint_at_its_end() -> None:
    world = edited("length_scale(link_0)", 1.5, arm())

    assert [joint.origin_m[2] for joint in world.joints] == pytest.approx([0.2, 0.3, 0.2])
    assert isinstance(world.bodies[1].shape, Box)
    assert world.bodies[1].shape.size_m == pytest.approx((0.075, 0.075, 0.3))
    assert world.start_height_m == arm().start_height_m  # its base is fixed


def test_tunables_that_rebuild_edit_before_those_that_edit_in_place() -> None:
    labels = ["mass(trunk)", "length_scale(*_shin)", "slope"]
    simulation = Simulation(Quadruped(), Analytic(), edits_of(labels))

    world = simulation.world(np.array((1.2, 1.1, 0.05)))
    heavier = simulation.world(np.array((0.9, 1.1, 0.02)))

    assert body(world, "trunk").mass_kg == pytest.approx(1.8)
    assert body(world, "rear_left_shin").center_m[2] == pytest.approx(-0.165)
    in_place = frozenset({"body.mass_kg", "slope_rad"})
    assert world.built(in_place) == heavier.built(in_place)
    assert world.built(in_place).bodies[0].mass_kg == WORLD.bodies[0].mass_kg


class Slimmer(Tunable):
    """A tunable of a plug-in that knows of `dataclasses.replace` alone."""

    name = "slimmer"
    field = "body.shape"
    unit = "m"
    lower, upper, least, greatest = 0.01, 0.1, 0.0, 1.0

    def read(self, world: Any) -> float:
        return float(world.bodies[0].shape.size_m[2])

    def edit(self, world: Any, value: float) -> Any:
        return replace(world, bodies=(replace(world.bodies[0], shape=Box((0.3, 0.2, value))), *world.bodies[1:]))


@pytest.mark.parametrize("other", ["mass(trunk)", "center_of_mass(rear_left_shin)", "slope"])
def test_what_a_plug_in_replaces_is_built_whatever_else_is_tuned(other: str) -> None:
    simulation = Simulation(Quadruped(), Analytic(), [tunable_of(other), Slimmer()])

    world = simulation.world(np.array((1.1 if other == "mass(trunk)" else 0.02, 0.05)))

    assert world.bodies[0].shape == Box((0.3, 0.2, 0.05))
    everything = frozenset({"body.mass_kg", "body.center_m", "slope_rad"})
    assert world.built(everything).bodies[0].shape == Box((0.3, 0.2, 0.05))


def test_noise_and_latency_are_of_the_worlds_noise() -> None:
    world = edited("latency", 0.04, edited("noise(tilt)", 0.2, edited("noise", 0.1)))

    assert world.noise == Noise(target=0.1, tilt=0.2, latency_s=0.04)
    assert unit_of("noise(angle_rad)") == "rad"
    assert unit_of("mass(trunk)") == "1"
    assert unit_of("mass(trunk, as=value)") == "kg"
    assert unit_of("nothing(trunk)") == ""


def test_default_bounds_have_the_robots_own_value_inside() -> None:
    damped = replace(WORLD, joints=tuple(replace(joint, damping=0.8) for joint in WORLD.joints))

    assert tunable_of("joint_damping").bounds(WORLD) == (0.0, 0.5)
    assert tunable_of("joint_damping").bounds(damped) == (0.0, pytest.approx(1.6))
    assert tunable_of("mass(trunk, as=value)").bounds(WORLD) == pytest.approx((0.7 * 1.5, 1.3 * 1.5))
    assert tunable_of("max_torque(*, as=value)").bounds(WORLD) == pytest.approx((0.1 * 8.0, 1.5 * 8.0))
    assert tunable_of("kp(*, as=value)").bounds(arm()) == pytest.approx((0.5 * 50.0, 1.5 * 50.0))


def test_the_frame_of_the_sensors_and_their_biases_are_set_one_by_one() -> None:
    world = edited("gravity_tilt(y)", 0.02, edited("gravity_tilt", -0.01, edited("ground_height", 0.005)))
    knees = edited("bias(*_knee)", 0.03)
    one = edited("bias(rear_left_knee)", 0.01, knees)

    assert (world.gravity_tilt_rad, world.ground_m) == ((-0.01, 0.02), 0.005)
    assert world.edits == {"gravity_tilt_rad", "ground_m"}
    assert len(knees.biases) == 4
    assert dict(one.biases)["angle rear_left_knee"] == 0.01
    assert tunable_of("bias(*_knee)").read(one) == pytest.approx(0.025)
    assert edited("bias(*_knee)", 0.0, one) == WORLD
    assert edited("joint_static_friction(*_knee)", 0.2).joints[2].static_friction == 0.2
    assert edited("joint_stribeck_speed", 0.3).joints[0].stribeck_speed == 0.3


def test_what_lies_between_physics_and_sensors_is_refused_where_there_is_none() -> None:
    unread = refusals(tunables=["bias(front_left_knee)", "bias(front_left_toe)"])
    looping = refusals(tunables=["time_offset"], controller="mlp")
    planned = refusals(tunables=["latency", "noise(angle_rad)", "noise", "noise(start_tilt_rad)"])
    unmoved = refusals(robot="toy_function", engine="analytic", tunables=["time_offset", "ground_height"])

    assert "is of angle front_left_knee, and the quadruped reads roll and pitch" in unread["/tunables/0"].message
    assert unread["/tunables/0"].permitted == "a task that reads it"
    assert "matches no joint" in unread["/tunables/1"].message
    assert "that of the quadruped observes while it acts" in looping["/tunables/0"].message
    assert [*planned] == ["/tunables/0", "/tunables/1"]
    assert planned["/tunables/1"].permitted == "left out, or a controller that observes while it acts"
    assert "the robot has no motors" in unmoved["/tunables/0"].message
    assert "analytic does not honour ground_height" in unmoved["/tunables/1"].message
    assert resolved(tunables=["bias(front_left_knee)"], controller="mlp").tunables  # which observes it


def test_an_engine_need_not_know_of_noise_but_of_all_else() -> None:
    assert resolved(robot="toy_function", engine="analytic", tunables=["noise"]).reality.parameters == {"noise": 0.0}
    found = refusals(robot="toy_function", engine="analytic", tunables=["slope"])
    assert "analytic does not honour slope" in found["/tunables/0"].message


def test_the_usual_tunables_follow_a_rule() -> None:
    assert usual_tunables(WORLD) == ("dynamic_friction", "mass(trunk)", "motor_gain", "joint_damping")
    assert usual_tunables(arm()) == ("mass(link_2)", "kp", "joint_damping", "joint_friction")
    assert usual_tunables(replace(arm(), observed="link_1"))[0] == "mass(link_1)"
    feet = replace(
        WORLD,
        bodies=tuple(replace(each, surface="rubber" if each.touches else "") for each in WORLD.bodies),
        surfaces=(("rubber", Material(1.1, 1.1)),),
    )
    assert usual_tunables(feet)[0] == "dynamic_friction(rubber)"
    for world in (WORLD, arm(), feet):
        assert all(tunable_of(label).lack(world) is None for label in usual_tunables(world))


@pytest.mark.parametrize("name", ["trunk (2)", "link[1]", "a,b=c", "wheel*", "what?", "b" * 100])
def test_any_name_of_a_body_can_be_in_a_label(name: str) -> None:
    world = replace(WORLD, bodies=(replace(WORLD.bodies[0], name=name), *WORLD.bodies[1:]))
    mass = tunable_of(usual_tunables(world)[1])

    edited = mass.edit(world, 1.1)

    assert label_of(mass) == usual_tunables(world)[1]
    assert [body.mass_kg for body in edited.bodies[1:]] == [body.mass_kg for body in WORLD.bodies[1:]]
    assert edited.bodies[0].mass_kg == pytest.approx(1.1 * WORLD.bodies[0].mass_kg)


def test_a_name_that_is_a_pattern_too_means_itself() -> None:
    names = ("link[1]", "link1", "link*")

    assert matching("link[1]", names) == ("link[1]",)
    assert matching("link*", names) == ("link*",)
    assert matching("link?", names) == ("link1", "link*")


def test_a_robot_has_its_usual_tunables_where_a_spec_names_none(monkeypatch: pytest.MonkeyPatch) -> None:
    class Imported(Quadruped):
        usual_tunables = usual_tunables(WORLD)

    monkeypatch.setattr(resolution, "robot_of", lambda _spec: Imported())
    usual, given = ["dynamic_friction", "mass(trunk)", "motor_gain", "joint_damping"], ["restitution"]

    def names(refs: Any) -> list[str]:
        return [ref.name for ref in refs]

    assert names(resolved().tunables) == usual
    assert names(resolved(tunables=given).tunables) == given
    study = {"strategies": ["random"], "engine": "mujoco"}
    assert names(resolve(StudySpec.model_validate(study))[0].tunables) == usual
    assert names(resolve(StudySpec.model_validate({**study, "tunables": given}))[0].tunables) == given
    assert names(resolve_sensitivity(SensitivitySpec.model_validate({"engine": "mujoco"})).tunables) == usual


def test_base_aspects_of_the_envelope_are_named_by_label() -> None:
    spec = resolved(
        strategy={"name": "noise_envelope", "options": {"base": "mass(of=trunk), slope"}},
        tunables=["mass(trunk)", "slope", "noise"],
    )
    assert spec.strategy.options["base"] == ["mass(trunk)", "slope"]
    strategy = NoiseEnvelope(NoiseEnvelopeOptions(base=("mass(trunk)", "slope"), epsilon=0.1, simulators=200))

    space = Space.box([0.7, -0.1, 0.0], [1.3, 0.1, 0.1])
    drawn = strategy.draw(space, [ref.name for ref in spec.tunables], np.random.default_rng(0))

    spread = np.ptp(drawn, axis=0) / space.extent
    assert spread[:2].max() < 0.21
    assert spread[2] > 0.9
    found = refusals(strategy={"name": "noise_envelope", "options": {"base": "mass"}}, tunables=["mass(trunk)"])
    assert "names mass, which the spec does not tune" in found["/strategy/options"].message
