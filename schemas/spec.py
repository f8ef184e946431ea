"""What a user submits: an experiment, or a study of several to be compared.

Whatever is left out of a submitted spec has a default, and the defaults are the paper's. A *resolved* spec is the same
type with nothing left out: that is what is stored, so that a later change of a default changes no stored experiment.
"""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from gaplab.schemas.base import Count, Examples, Frozen, Label, Priority, Real, Seed
from gaplab.schemas.plugin import PluginRef, TunableRef

BudgetName = Literal["smoke", "desk", "paper"]


class BudgetSpec(Frozen):
    """How much is computed; a number left out is the preset's.

    `evaluations` count fitness evaluations of one search. A selection in an ensemble of m simulators costs m rollouts
    an evaluation; a tuning on k samples costs k.
    """

    preset: BudgetName = "paper"
    controller_evaluations: Count | None = Field(
        default=None, description="of the search for the transferred controller"
    )
    selection_evaluations: Count | None = Field(default=None, description="of the search for the next sample")
    simulator_evaluations: Count | None = Field(default=None, description="of the search for a simulator")
    reuse_transfer: bool = Field(
        default=True,
        strict=True,
        description="`simulated_fit` tries the controller that was just transferred, instead of searching again: "
        "the best of `controller_evaluations`, where other strategies select from `selection_evaluations`",
    )

    @model_validator(mode="before")
    @classmethod
    def _accept_a_bare_preset(cls, value: object) -> object:
        return {"preset": value} if isinstance(value, str) else value


class RealitySpec(Frozen):
    """The reality that the algorithm may ask but not see: an engine and its hidden parameters.

    An engine left out is the experiment's own; a parameter left out is the robot's own, which is the paper's reality
    (static friction 1.0, dynamic friction 0.8, restitution 0.0).
    """

    engine: PluginRef | None = None
    parameters: dict[str, Real] = Field(default_factory=dict)


class Settings(Frozen):
    """What the experiments of a study have in common."""

    iterations: Annotated[Count, Field(le=1_000)] | None = Field(default=None, description="the paper: 10")
    repetitions: Annotated[Count, Field(le=10_000)] | None = Field(default=None, description="the paper: 40")
    robot: PluginRef = PluginRef(name="quadruped")
    engine: PluginRef | None = Field(default=None, description="left out: the robot's own; PyBullet for the quadruped")
    optimizer: PluginRef = PluginRef(name="steady_state")
    tunables: tuple[TunableRef, ...] = Field(
        default=(
            TunableRef(name="static_friction"),
            TunableRef(name="dynamic_friction"),
            TunableRef(name="restitution"),
        ),
        min_length=1,
    )
    reality: RealitySpec = RealitySpec()
    budget: BudgetSpec = BudgetSpec()
    seed: Seed = 0


class Schedule(Frozen):
    """How soon an experiment has its turn. It changes no number, so it is not stored with what makes the results."""

    priority: Priority = Field(default=0, description="the higher is computed first")
    max_parallel: Annotated[Count, Field(le=10_000)] | None = Field(
        default=None, description="repetitions of an experiment that run at once; null: as many as have a core"
    )


class ExperimentSpec(Settings, Schedule):
    """One strategy under one setting, repeated."""

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


class StudySpec(Settings, Schedule):
    """Experiments to be compared: one for each strategy, all else equal; the schedule is that of each of them.

    `direct` is the baseline, evolution in reality itself; the paper repeats it 100 times where it repeats the
    strategies 40 times.
    """

    EXAMPLES: ClassVar[Examples] = {
        "Fig. 4": {
            "summary": "The paper's whole Fig. 4: six strategies and the direct baseline; 1 500 core-hours",
            "value": {"name": "Fig. 4", "direct_repetitions": 100},
        },
        "quick": {
            "summary": "The same on the toy function; seconds",
            "value": {"name": "toy", "robot": "toy_function", "budget": "smoke"},
        },
    }

    name: Label | None = None
    strategies: tuple[PluginRef, ...] = Field(
        default=(
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
    direct_repetitions: Annotated[Count, Field(le=10_000)] | None = Field(
        default=None, description="left out: as many as the strategies have"
    )
