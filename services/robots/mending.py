"""Masses and inertias that no rigid body has: refused, or replaced where the user asks for it."""

from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.notes import Notes

LEAST_KG = 0.001
"""Mass that a moving body without one gets."""

HELD_KG = 1.0
"""Mass that a base gets that never moves and has none."""

GYRATION_M = 0.03
"""Radius of gyration of a mended body without shapes."""

ROUNDING = 1e-6
"""Share by which a moment may exceed the sum of the other two, as files have rounded numbers: MuJoCo's own."""


def hold(base: Any, notes: Notes) -> None:  # noqa: ANN401
    """Give a base that never moves a mass and an inertia, if it has none: no number depends on it."""
    if base.explicitinertial and (base.mass <= 0 or min(_moments(base)) <= 0):
        base.mass = max(base.mass, HELD_KG)
        _change(base, HELD_KG)
        notes.lose("{} has no mass or no inertia, but never moves: it gets 1 kg m²", base.name)


def mend(spec: Any, notes: Notes, moved: set[str], *, allowed: bool) -> None:  # noqa: ANN401
    """Replace what no rigid body has, or refuse it.

    Moments that break the triangle inequality become their mean, as by MuJoCo's `balanceinertia`. Moments of zero
    become those of the body's shapes at uniform density.

    Args:
        spec: MuJoCo's `MjSpec`; its bodies are changed.
        notes: what is said about it.
        moved: names of the bodies with joints.
        allowed: whether to replace it.
    """
    empty = []
    for at, body in enumerate(spec.bodies):
        name = body.name or f"body{at}"
        if at == 0 or not body.explicitinertial:
            continue
        moments = _moments(body)
        if max(moments) > (sum(moments) - max(moments)) * (1 + ROUNDING):
            given = ", ".join(f"{moment:.4g}" for moment in moments)
            mean = float(np.mean(moments))
            _change(body, mean) if allowed else None
            _note(notes, allowed, f"{name}: moments {given} kg m² break the triangle inequality", f"{mean:.4g} each")
        elif name in moved and not _carried(body) and (body.mass <= 0 or min(moments) <= 0):
            empty.append((body, name))
    if not allowed:
        for body, name in empty:
            _note(notes, allowed, f"{name} moves, but has mass {body.mass:.4g} kg and a moment of inertia of 0", "")
        return
    if empty:
        _fill(spec, empty, notes)


def _note(notes: Notes, allowed: bool, fault: str, instead: str) -> None:
    if allowed:
        notes.lose(f"{fault}: mended to {instead}")
    else:
        notes.refuse(f"{fault}; --mend replaces it")


def _moments(body: Any) -> FloatArray:  # noqa: ANN401
    """Return `(3,)`: the principal moments that a body of a spec has."""
    full = np.array(body.fullinertia)
    if np.isnan(full[0]):
        return np.sort(np.array(body.inertia, dtype=float))
    xx, yy, zz, xy, xz, yz = full
    return np.asarray(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _change(body: Any, *moments: float) -> None:  # noqa: ANN401
    body.fullinertia = [np.nan, 0, 0, 0, 0, 0]
    body.inertia = moments * (1 if len(moments) == 3 else 3)


def _carried(body: Any) -> bool:  # noqa: ANN401
    """Return whether a massless body has its mass from bodies that are fixed to it."""
    return body.mass <= 0 and any(child.mass > 0 and not child.joints for child in body.bodies)


def _fill(spec: Any, empty: list[tuple[Any, str]], notes: Notes) -> None:  # noqa: ANN401
    """Give bodies the inertia of their shapes: a copy of the spec is compiled, in which MuJoCo computes it."""
    copy = spec.copy()
    for body, _ in empty:
        twin = copy.bodies[body.id] if not body.name else copy.body(body.name)
        if twin.geoms:
            twin.explicitinertial, twin.ipos = False, [np.nan] * 3  # MuJoCo computes what has no centre of mass
        else:
            twin.mass = 1.0
            _change(twin, GYRATION_M**2)
    model = copy.compile()
    for body, name in empty:
        found = model.body(name)
        before = body.mass
        body.mass = max(before, LEAST_KG)
        moments = found.inertia * body.mass / float(found.mass[0])
        _change(body, *moments.tolist())
        body.iquat = found.iquat
        given = ", ".join(f"{moment:.3g}" for moment in moments)
        _note(notes, True, f"{name}: mass {before:.4g} kg, inertia 0", f"{body.mass:.4g} kg and {given} kg m²")
