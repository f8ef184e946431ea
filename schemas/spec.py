"""Specs, which users submit: an experiment, or a study of several experiments.

Every missing field has a default, and the defaults are the paper's. A *resolved* spec has every field. It is what the
service stores, so a later change of a default changes no stored experiment.
"""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, Discriminator, Field, Tag, model_validator

from gaplab.schemas.base import Count, Examples, Frozen, Label, Priority, Read, Real, Repetitions, Seed, from_name
from gaplab.schemas.costs import Stop
from gaplab.schemas.measurements import Beyond, KnownSample, LimitsSpec
from gaplab.schemas.plugin import Named, PluginRef, TunableRef

BudgetName = Literal["smoke", "desk", "paper", "lean", "as_published"]


class BudgetSpec(Frozen):
    """Number of evaluations; a missing number is the preset's.

    `evaluations` are fitness evaluations of one search. In a selection with an ensemble of m simulators, an evaluation
    costs m rollouts; in a tuning on k samples, k rollouts.
    """

    preset: BudgetName = Field(
        "paper",
        description="`as_published` is `paper` with the formulas as the paper prints them: options that a strategy "
        "leaves out are those of its plain formula. `lean` is `paper` at a tenth of its rollouts: it also sets the "
        "optimizer of controllers, and options of the strategy and the tuner, where a spec leaves them out",
    )
    controller_evaluations: Count | None = Field(
        None, description="evaluations of the search for the transferred controller"
    )
    selection_evaluations: Count | None = Field(None, description="evaluations of the search for the next sample")
    simulator_evaluations: Count | None = Field(None, description="evaluations of the search for a simulator")
    reuse_transfer: bool = Field(
        False,
        strict=True,
        description="true: `simulated_fit` tries the controller that was just transferred, without another search. It "
        "is the best of `controller_evaluations`, while other strategies select from `selection_evaluations`, so it "
        "saves rollouts but makes comparisons unfair",
    )

    @model_validator(mode="before")
    @classmethod
    def _accept_a_bare_preset(cls, value: object) -> object:
        return from_name(value, "preset")


RealityKind = Literal["simulated", "physical", "recorded"]
Probes = Literal["each", "last", "never"]
Repeats = Annotated[Count, Field(le=1_000)]
KnownSamples = Annotated[tuple[KnownSample, ...], Field(max_length=10_000)]
NoiseOfReality = Annotated[float, Field(strict=True, ge=0, le=1e6)]
HeldOut = Annotated[float, Field(strict=True, ge=0, le=0.5)]


HeldOutOfPool = Annotated[float, Field(strict=True, ge=0, le=0.9)] | Literal["each"]


class PoolRef(Named):
    """A pool of recordings by its name, which means the newest of this name; a stored spec has its hash."""

    sha256: str | None = Field(None, max_length=64, description="hash of the pool")


def _is_none(value: object) -> bool:
    return value is None


class RealitySpec(Frozen):
    """Reality: an engine with hidden parameters, a robot that people or a driver run and measure, or recordings.

    The algorithm may evaluate reality but not read it. Of a simulated reality, a missing engine is that of the
    simulators, and a missing parameter is the robot's; for the quadruped, these are the paper's (static friction 1.0,
    dynamic friction 0.8, restitution 0.0). A physical reality has neither: its measurements are requested, and a
    repetition waits for each without a core or a process. A recorded one is a pool of motions that the robot did, of
    which a strategy selects one after another. Nothing is transferred or probed; what counts is the error of the tuned
    simulator on recordings that nothing saw.
    """

    kind: RealityKind = Field(
        "simulated",
        description="`physical`: a robot on a bench; measurements come in. `recorded`: motions that it did before",
    )
    pool: PoolRef | None = Field(None, exclude_if=_is_none, description="of a recorded reality: its recordings")
    held_out: HeldOutOfPool | None = Field(
        None,
        exclude_if=_is_none,
        description="share of the pool that no tuning sees, chosen by the seed; default: 0.2. `each`: every repetition "
        "holds out one recording, its own",
    )
    engine: PluginRef | None = Field(None, description="of a simulated reality; default: the simulators'")
    parameters: dict[str, Real] = Field(default_factory=dict, description="hidden; of a simulated reality")
    noise: NoiseOfReality | None = Field(
        None,
        exclude_if=_is_none,
        description="of a simulated reality: standard deviation of the noise of each measured fitness, as a share of "
        "about the fitness of `direct` (the fitness in simulation of the first transferred controller). Readings have "
        "the noise of their sensors then. The search of `direct` itself is without noise. Default: none",
    )
    noise_unit: NoiseOfReality | None = Field(
        None,
        exclude_if=_is_none,
        description="the same in the unit of fitness, in place of `noise`: equal for all strategies and repetitions",
    )
    bench: Label | None = Field(
        None,
        description="name of the physical robot; default: the robot's. The requests of one bench are taken one at a "
        "time, whatever experiment they are of",
    )
    repeats: Repeats = Field(
        1, description="values of each physical measurement; their mean is the fitness, and their spread is the noise"
    )
    samples: KnownSamples = Field(
        (),
        description="controllers of the physical robot that were measured before; the first simulators are tuned on "
        "them",
    )
    probes: Probes | None = Field(
        None,
        description="which transferred controllers are measured: of `each` iteration (default), of the `last` (default "
        "of a physical reality, where each costs), or `never`. Without a probe, the curve has the best sample so far",
    )
    limits: LimitsSpec | None = Field(
        None,
        description="limits of the physical robot; before a controller is offered, the latest simulators forecast "
        "whether it keeps them",
    )
    beyond: Beyond = Field(
        "warn",
        description="`warn`: a controller that is expected to exceed a limit is offered with a warning. `refuse`: it "
        "is not offered; it counts as tried and failed, and simulators are not tuned on it",
    )


class SharedSettings(Frozen):
    """Settings that all experiments of a study share."""

    iterations: Annotated[int, Field(strict=True, ge=0, le=1_000)] | None = Field(
        None,
        description="real-world evaluations of each repetition; the paper: 10. 0: tune on the samples from before, and "
        "measure nothing",
    )
    repetitions: Repetitions | None = Field(None, description="repetitions of each experiment; the paper: 40")
    stop: Stop | None = Field(
        None,
        exclude_if=_is_none,
        description="rollouts, time or cost that no repetition may exceed: each strategy has as many iterations as are "
        "expected to stay within it, `iterations` at most. It counts all searches as full. `direct` counts at any cost",
    )
    robot: PluginRef = PluginRef(name="quadruped")
    controller: PluginRef | None = Field(
        None, description="how a genome drives the actuators; default: the robot's own"
    )
    task: PluginRef | None = Field(
        None, description="how long a rollout lasts, and what is fit in it; default: the robot's own"
    )
    engine: PluginRef | None = Field(
        None,
        description="engine of the simulators; default: the robot's, PyBullet for the quadruped (MuJoCo on Python 3.12 "
        "and later, for which PyBullet has no wheels)",
    )
    optimizer: PluginRef = PluginRef(name="steady_state")
    controller_optimizer: PluginRef | None = Field(
        None,
        description="optimizer that searches for controllers; default: `optimizer`, which searches for simulators; "
        "with the budget `lean`: `cma_es`",
    )
    tunables: tuple[TunableRef, ...] = Field(
        (TunableRef(name="static_friction"), TunableRef(name="dynamic_friction"), TunableRef(name="restitution")),
        min_length=1,
    )
    discrepancy: PluginRef = Field(
        PluginRef(name="squared_fitness"), description="what tuning minimises, summed over the samples"
    )
    tuner: PluginRef = Field(PluginRef(name="search"), description="how simulators are found")
    held_out: HeldOut = Field(
        0.0,
        description="share of the samples that no tuning sees; the error of tuned simulators on them is reported. 0.2: "
        "each fifth sample",
    )
    reality: RealitySpec = RealitySpec()
    budget: BudgetSpec = BudgetSpec()
    seed: Seed = 0


class Schedule(Frozen):
    """Schedule of an experiment. It changes no number, so it is not part of the stored spec."""

    priority: Priority = Field(0, description="the highest priority is computed first")
    max_parallel: Repetitions | None = Field(
        None, description="largest number of repetitions of an experiment at once; null: no limit"
    )


class ExperimentSpec(SharedSettings, Schedule):
    """One strategy with one setting, repeated."""

    EXAMPLES: ClassVar[Examples] = {
        "the least": {
            "summary": "One strategy at the paper's protocol; every default is the paper's",
            "value": {"strategy": "simulated_fit", "iterations": 10, "repetitions": 40},
        },
        "quick": {
            "summary": "Seconds: the toy function of the paper's Fig. 3",
            "value": {"strategy": "simulated_fit_and_informative", "robot": "toy_function", "budget": "smoke"},
        },
        "in detail": {
            "summary": "Your own options, bounds, reality and budget",
            "value": {
                "name": "half the weight on information",
                "strategy": {"name": "simulated_fit_and_informative", "options": {"informative_weight": 0.5}},
                "iterations": 5,
                "repetitions": 20,
                "tunables": ["static_friction", {"name": "dynamic_friction", "lower": 0.2, "upper": 1.2}],
                "reality": {"parameters": {"static_friction": 0.9, "dynamic_friction": 0.6}},
                "budget": {"preset": "desk", "simulator_evaluations": 800},
                "seed": 2012,
            },
        },
    }

    name: Label | None = None
    strategy: PluginRef


class StudySpec(SharedSettings, Schedule):
    """Experiments to compare: one for each strategy, all else equal. The schedule applies to each of them.

    `direct` is the baseline, evolution in reality itself. The paper has 100 repetitions of it, and 40 of each strategy.
    """

    EXAMPLES: ClassVar[Examples] = {
        "Fig. 4": {
            "summary": "The paper's whole Fig. 4: 1,200 core-hours, so it needs `?confirm_cost=true`",
            "value": {"name": "Fig. 4", "direct_repetitions": 100},
        },
        "quick": {
            "summary": "The same on the toy function; seconds",
            "value": {"name": "toy", "robot": "toy_function", "budget": "smoke"},
        },
    }

    name: Label | None = None
    strategies: tuple[PluginRef, ...] = Field(
        (
            PluginRef(name="simulated_fit"),
            PluginRef(name="simulated_fit_and_unique"),
            PluginRef(name="informative"),
            PluginRef(name="simulated_fit_and_informative"),
            PluginRef(name="random"),
            PluginRef(name="known_fit"),
            PluginRef(name="direct"),
        ),
        min_length=1,
        max_length=100,
    )
    direct_repetitions: Repetitions | None = Field(None, description="repetitions of `direct`; default: `repetitions`")


def kind_of(spec: object) -> Literal["experiment", "study"]:
    """Return of what a submitted spec is: it is one of an experiment if it names a strategy, and no strategies."""
    names = spec.model_fields_set if isinstance(spec, BaseModel) else spec if isinstance(spec, Mapping) else ()
    return "experiment" if "strategy" in names and "strategies" not in names else "study"


AnySpec = Annotated[
    Annotated[ExperimentSpec, Tag("experiment")] | Annotated[StudySpec, Tag("study")], Discriminator(kind_of)
]
"""The spec of a study, or of an experiment, which makes a study of one."""


class SpecRead(Read):
    """The spec of a study: what a person would submit, and what was stored."""

    spec: dict[str, Any] | None = Field(
        description="as it was submitted, or with every field if that is not known; null if no single spec gives all "
        "experiments",
        examples=[{"strategies": ["simulated_fit", "random"], "engine": "mujoco", "budget": "smoke"}],
    )
    resolved: tuple[dict[str, Any], ...] = Field((), description="the complete spec of each experiment")
    remarks: tuple[str, ...] = Field((), description="what the spec lacks, in words")
