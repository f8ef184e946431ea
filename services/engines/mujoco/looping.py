"""Controllers in loops: all rollouts of a call are stepped together, with one call of the controller in each period."""

from collections.abc import Hashable, Sequence

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motions import Loop
from gaplab.services.core.observations import observations
from gaplab.services.core.world import World
from gaplab.services.engines.agenda import Acting, tick_steps
from gaplab.services.engines.mujoco.controls import Controls, Steps, grouped, held
from gaplab.services.engines.mujoco.models import Prepared
from gaplab.services.engines.mujoco.pool import Continued, Pool
from gaplab.services.engines.mujoco.states import States


class Looping:
    """Loops in the worlds of a scene.

    Args:
        pool: MuJoCo.
        states: what a state says.
        controls: where targets go.
    """

    def __init__(self, pool: Pool, states: States, controls: Controls) -> None:
        self._pool = pool
        self._states = states
        self._controls = controls

    def run(
        self, prepared: Sequence[Prepared], loops: Sequence[Loop], kept: Steps, told: FloatArray | None = None
    ) -> FloatArray:
        """Return states `(n · m, t, state)` after the given steps, by loop and world.

        Args:
            prepared: m worlds.
            loops: n loops, which share their function and their times.
            kept: `(t,)`, ascending: steps; the last one ends the rollout.
            told: `(n · m, steps, degrees of freedom)`: zeros, overwritten with the targets in each step; None if nobody
                asks for them.
        """
        run, end = _Run(self._states, prepared, loops), int(kept[-1])
        at = np.array(tick_steps(loops[0], prepared[0].world.time_step_s))
        targets = np.empty((len(run.models), len(at), len(prepared[0].world.actuators)))  # of each call
        delays = grouped([each.delays for each in prepared] * len(loops))
        found = np.empty((len(run.models), len(kept), len(self._states.start)))
        found[:, kept == 0] = run.recent[:, -1:]
        now = Continued(run.recent[:, -1], np.zeros((len(run.models), self._controls.width)))
        with self._pool.sensing(run.models[: len(prepared)]):
            for tick, (begin, then) in enumerate(zip(at, [*np.minimum(at[1:], end), end], strict=True)):
                targets[:, tick] = run.targets(tick)
                if begin == then:
                    continue
                controls = np.zeros((len(run.models), then - begin, self._controls.width))
                for late, columns in delays:
                    for column in columns:
                        given = targets[column, : tick + 1]
                        self._controls.put(controls[column], held(at[: tick + 1], given, np.arange(begin, then), late))
                if told is not None:
                    told[:, begin:then] = controls
                states, now = self._pool.advanced(run.models, now, controls)
                run.see(states)
                inside = (kept > begin) & (kept <= then)
                found[:, inside] = states[:, kept[inside] - begin - 1]
        return found


class _Run:
    """The controllers of a call, and what they observe."""

    def __init__(self, states: States, prepared: Sequence[Prepared], loops: Sequence[Loop]) -> None:
        self.models = [each.model for each in prepared] * len(loops)
        self._states = states
        self._senses = loops[0].senses
        self._acting = Acting([loop for loop in loops for _ in prepared])
        step_s = prepared[0].world.time_step_s
        lags = np.repeat([round(loop.latency_s / step_s) for loop in loops], len(prepared))
        self._length = int(lags.max()) + 1
        self._seen_at = np.arange(len(lags)), self._length - 1 - lags
        self.recent = np.repeat(states.starts(loops, len(prepared))[:, None], self._length, axis=1)
        self._worlds: dict[Hashable, tuple[World, list[int]]] = {}
        for row, each in enumerate([*prepared] * len(loops)):
            self._worlds.setdefault(_looks(each.world), (each.world, []))[1].append(row)

    def see(self, states: FloatArray) -> None:
        """Remember the latest states `(rows, steps, state)`, as far back as they are observed."""
        behind = [self.recent, states] if states.shape[1] < self._length else [states]
        self.recent = np.concatenate(behind, axis=1)[:, -self._length :]

    def targets(self, tick: int) -> FloatArray:
        """Return the targets `(rows, a)` that controllers set now."""
        seen = self.recent[self._seen_at]
        with np.errstate(all="ignore"):  # physics that failed gives nan, or numbers without bounds
            found = [
                observations(world, self._senses, self._states.bearing(seen[rows]))
                for world, rows in self._worlds.values()
            ]
            order = np.argsort(np.concatenate([rows for _, rows in self._worlds.values()]), kind="stable")
            return self._acting.targets(tick, np.concatenate(found)[order])


def _looks(world: World) -> Hashable:
    """Return what observations depend on, of worlds of one structure: the slope, and where shapes are."""
    solids = [body.center_m for body in world.bodies if not isinstance(body.shape, tuple)]
    return world.slope_rad, *solids
