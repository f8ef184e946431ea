"""A recurrent network whose weights change while it acts, by rules that are evolved."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.space import Space
from gaplab.services.world.controllers.base import Controller
from gaplab.services.world.controllers.parts import Scaling, Senses, middles, swings, weighted
from gaplab.services.world.controllers.pulses import Pulses
from gaplab.services.world.motions import Loop
from gaplab.services.world.sensing import stream_of
from gaplab.services.world.world import World

RATES = frozen([0.0, 1 / 3, 2 / 3, 1.0])
"""Rates of learning; the rules are in `_changes`."""

SMALL = 0.1
"""Largest weight at first."""

AT_REST = 0.5
"""Activity of a neuron without input, and of all neurons at first."""

NEGATIVE_SIGN, PLAIN_RULE, RATE_OF_A_THIRD = 0.25, 0.125, 0.375
"""Genes of each neuron of the known genome."""


class PlasticOptions(Frozen):
    """Options of the controller `plastic`."""

    base: Literal["pulses", "none"] = Field(
        default="pulses",
        description="what the network adds to: pulses as in `square_pulses`, whose genes come first, or each middle",
    )
    senses: Senses = Field(
        default=("angles", "tilt", "contacts"),
        description="groups of observations, separated by commas: angles, speeds, tilt, turning, contacts",
    )
    hidden: Annotated[int, Field(strict=True, ge=0, le=256)] = Field(
        default=0, description="neurons besides those of the actuators, one for each"
    )
    gain: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=0.5, description="farthest target of the network alone, as a factor of each joint's usual swing"
    )
    period_s: Annotated[Real, Field(ge=0.001, le=10)] = Field(default=0.02, description="interval between new targets")
    learning_s: Annotated[Real, Field(gt=0, le=10)] = Field(
        default=0.1, description="interval between changes of weights, rounded to whole `period_s`; authors': 0.1"
    )
    pulse_s: Annotated[Real, Field(gt=0, le=60)] = Field(default=0.5, description="period of the pulses")


class Plastic(Controller):
    """A recurrent network with a Hebb rule and a rate for each neuron, which learns weights during the rollout.

    Neuron i has the activity y = logistic(Σ sⱼ wᵢⱼ xⱼ), where x are the activities of all neurons, and observations
    squashed to 0 … 1; s are their signs. Weights start below 0.1, drawn by the digest of the genome, and are between 0
    and 1. Every `learning_s`, w becomes w + η Δw, with the neuron's rate η of 0, ⅓, ⅔ or 1, and its rule:

    - plain: (1 - w) x y,
    - postsynaptic: w (x - 1) y + (1 - w) x y,
    - presynaptic: w x (y - 1) + (1 - w) x y,
    - covariance: (1 - w) F if F > 0, else w F, with F = tanh(4 (1 - |x - y|) - 2).

    The first a neurons add gain · swing · (2 y - 1) to the targets of the base. Genes, all in [0, 1]: those of the
    pulses, if they are the base; sign, rule and rate of each neuron; the sign of each observation, positive from 0.5.
    """

    name = "plastic"
    source = "Floreano and Urzelai 2001; the pulses, and the numbers without an author, are gaplab's"
    loops = True
    Options = PlasticOptions
    options: PlasticOptions

    def prepare(self, world: World, observe_s: FloatArray) -> None:
        """Compute what all loops share."""
        options, self._actuators = self.options, len(world.actuators)
        self._scaled = Scaling(world, options.senses)
        self._neurons = self._actuators + options.hidden
        self._inputs = self._neurons + self._scaled.size
        self._pulses = Pulses(world, options.pulse_s, 1.0) if options.base == "pulses" else None
        first = self._pulses.genes if self._pulses else 0
        others = 3 * self._neurons + self._scaled.size
        wraps = self._pulses.wraps if self._pulses else []
        self.space = Space.box([0.0] * (first + others), [1.0] * (first + others), [*wraps, *[False] * others])
        of_neurons = [NEGATIVE_SIGN, PLAIN_RULE, RATE_OF_A_THIRD] * self._neurons
        of_pulses = self._pulses.known.tolist() if self._pulses else []
        self.known = frozen([*of_pulses, *of_neurons, *[1.0] * self._scaled.size])
        self._middles, self._swings = middles(world), swings(world, options.gain)
        self._every = max(1, round(options.learning_s / options.period_s))
        self._first, self._observe_s, self._act = first, observe_s, self.act

    def motion(self, genome: Genome) -> Loop:
        """Return the loop of the network; its memory is the weights, then the activities."""
        weights = SMALL * stream_of(genome, "first weights").random(self._neurons * self._inputs)
        memory = frozen([*weights, *[AT_REST] * self._neurons])
        return Loop(self._act, self.options.senses, genome, memory, self.options.period_s, self._observe_s)

    def act(
        self, genomes: FloatArray, observations: FloatArray, memory: FloatArray, time_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return targets `(n, a)`, and the weights and activities from now on."""
        count, own = len(genomes), genomes[:, self._first :]
        weights = memory[:, : -self._neurons].reshape(count, self._neurons, self._inputs)
        sensed = (1 + np.tanh(self._scaled(observations))) / 2
        before = np.hstack([memory[:, -self._neurons :], sensed])
        genes = own[:, : 3 * self._neurons]
        signs = np.where(np.hstack([genes[:, 0::3], own[:, 3 * self._neurons :]]) < 0.5, -1.0, 1.0)
        after = 1 / (1 + np.exp(-weighted(weights, signs * before)))
        if (tick := round(time_s / self.options.period_s)) and tick % self._every == 0:
            weights = weights + _changes(genes, weights, before[:, None, :], after[:, :, None])
        base = self._pulses.targets(genomes, time_s) if self._pulses else self._middles
        targets = base + self._swings * (2 * after[:, : self._actuators] - 1)
        return targets, np.hstack([weights.reshape(count, -1), after])


def _changes(genes: FloatArray, weights: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the changes of weights `(n, neurons, inputs)`.

    Genes `(n, 3 · neurons)` are sign, rule and rate of each neuron. Activities before the synapses are x,
    `(n, 1, inputs)`, those after them y, `(n, neurons, 1)`.
    """
    grown = (1 - weights) * x * y
    alike = np.tanh(4 * (1 - np.abs(x - y)) - 2)
    rules = (
        grown,
        weights * (x - 1) * y + grown,
        weights * x * (y - 1) + grown,
        np.where(alike > 0, 1 - weights, weights) * alike,
    )
    kinds = len(rules)
    rule = np.minimum((kinds * genes[:, 1::3]).astype(int), kinds - 1)[:, :, None]
    rate = RATES[np.minimum((len(RATES) * genes[:, 2::3]).astype(int), len(RATES) - 1)][:, :, None]
    return np.asarray(rate * np.choose(rule, rules))
