"""What `mujoco.sysid` makes of recordings of an arm: the reference of `benchmarks.so101`.

It is of Google DeepMind (Apache-2.0), and comes with `pip install "mujoco-core[sysid]"`. Its own rollouts of the MJCF
are compared, with the same tunables and bounds.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from importlib import import_module
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.pools import Pool

mujoco: Any = import_module("mujoco")  # without types
rollout: Any = import_module("mujoco.rollout")
sysid: Any = import_module("mujoco.sysid")

ROUNDS = 25
"""Most iterations; each costs a rollout of each motion for each tunable."""

Bounds = Mapping[str, tuple[float, float]]
"""Bounds by label, like `bias(elbow_flex)`, or `delay`."""


def _without_shapes(spec: Any) -> Any:  # noqa: ANN401 - of a library without types
    """Return the model without shapes, as its links touch nothing in gaplab; all of them have stated inertias."""
    for each in [*spec.worldbody.find_all("geom"), *spec.meshes, *spec.materials, *spec.textures]:
        spec.delete(each)
    return spec


class Arm:
    """An MJCF whose tunables `mujoco.sysid` fits.

    Args:
        file: the MJCF.
        pool: recordings of its joints' angles.
        bounds: of the tunables.
        step_s: time step.
    """

    def __init__(self, file: Path, pool: Pool, bounds: Bounds, step_s: float) -> None:
        self.spec, self.pool = _without_shapes(mujoco.MjSpec.from_file(str(file))), pool
        self.spec.option.timestep = step_s
        for joint in pool.joints:
            kind = mujoco.mjtSensor.mjSENS_JOINTPOS
            self.spec.add_sensor(name=joint, type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint)
        self.model, self.params = self.spec.compile(), sysid.ParameterDict()
        for label, (low, high) in bounds.items():
            middle = (low + high) / 2
            self.params.add(sysid.Parameter(label, middle, low, high, modifier=self._modifier(label)))

    def errors(self, motions: Sequence[int], fitted: Sequence[int] = ()) -> FloatArray:
        """Return `(n, j)`: root mean square errors of each joint in motions, rad; fitted to others, or as it is."""
        if not fitted:
            found, params = self.model, None
        else:
            residual = sysid.build_residual_fn(
                models_sequences=[self._sequences(each) for each in fitted],
                modify_residual=self._residual,
                resample_true=False,
            )
            with redirect_stdout(StringIO()):
                params, _ = sysid.optimize(self.params, residual, "mujoco", verbose=False, max_iters=ROUNDS)
            found = sysid.apply_param_modifiers(params, self.spec)
        return frozen([self._error(found, params, each) for each in motions])

    def _modifier(self, label: str) -> Callable[[Any, Any], object] | None:
        name, _, joint = label.removesuffix(")").partition("(")
        fields = {"joint_friction": "frictionloss", "armature": "armature"}
        if name in fields:
            return lambda spec, one: setattr(spec.joint(joint), fields[name], one.value[0])
        if name == "joint_damping":
            return lambda spec, one: setattr(spec.joint(joint), "damping", [one.value[0], 0.0, 0.0])
        if name == "kp":
            return lambda spec, one: sysid.apply_pgain(spec, joint.partition(",")[0], one.value[0])
        if name == "kd":
            return lambda spec, one: [sysid.apply_dgain(spec, each.name, one.value[0]) for each in spec.actuators]
        return None

    def _sequences(self, number: int) -> Any:  # noqa: ANN401 - of a library without types
        measured, mapping = self._measured(number), sysid.TimeSeries.compute_all_sensor_mapping(self.model)
        name = self.pool.recordings[number].name
        sensed = sysid.TimeSeries(measured[0], measured[1], mapping)
        controls = sysid.TimeSeries(*self._controls(number))
        return sysid.ModelSequences(name, self.spec, name, self._start(number), controls, sensed)

    def _measured(self, number: int) -> tuple[FloatArray, FloatArray]:
        readings = self.pool.readings(number)
        whole = np.isfinite(readings).all(axis=1)
        return np.array(self.pool.times_s)[whole], readings[whole]

    def _controls(self, number: int) -> tuple[FloatArray, FloatArray]:
        recorded, until_s = self.pool.recordings[number], self._measured(number)[0][-1]
        times_s = np.arange(round(until_s / self.model.opt.timestep) + 1) * self.model.opt.timestep
        rows = np.searchsorted(recorded.times_s, times_s + 1e-9, side="right") - 1
        return times_s, np.array(recorded.commands)[np.maximum(rows, 0)]

    def _start(self, number: int) -> FloatArray:
        angles = np.array(self.pool.recordings[number].start.angles_rad)
        return np.asarray(sysid.create_initial_state(self.model, angles, np.zeros_like(angles)))

    def _residual(self, params: Any, predicted: Any, measured: Any, *_: Any, **__: Any) -> tuple[Any, Any, Any]:  # noqa: ANN401
        said = self._said(predicted.times, predicted.data, params, measured.times)
        return (said - measured.data) / np.sqrt(measured.data.size), measured, measured

    def _said(self, own_s: FloatArray, angles: FloatArray, params: Any, times_s: FloatArray) -> FloatArray:  # noqa: ANN401
        delay = 0.0 if params is None or "delay" not in params else params["delay"].value[0]
        columns = [np.interp(times_s - delay, own_s, column) for column in angles.T]
        biases = [0.0 if params is None else params[f"bias({joint})"].value[0] for joint in self.pool.joints]
        return np.asarray(np.array(columns).T + biases)

    def _error(self, model: Any, params: Any, number: int) -> FloatArray:  # noqa: ANN401
        times_s, angles = self._measured(number)
        data = mujoco.MjData(model)
        state, sensed = rollout.rollout(model, data, self._start(number)[None], self._controls(number)[1][None, :-1])
        said = self._said(state[0, :, 0], sensed[0], params, times_s)
        return np.asarray(np.sqrt(((said - angles) ** 2).mean(axis=0)))
