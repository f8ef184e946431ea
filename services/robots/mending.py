"""Masses and inertias that no rigid body has: refused, or replaced where the user asks for it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.robots.options import Notes

LEAST_KG = 0.001
"""Mass that a moving body without one gets."""

HELD_KG = 1.0
"""Mass that a base gets that never moves and has none."""

GYRATION_M = 0.03
"""Radius of gyration of a mended body without shapes."""

ROUNDING = 1e-6
"""Share by which a moment may exceed the sum of the other two, as files have rounded numbers: MuJoCo's own."""


def hold(base: Any, notes: Notes) -> Mapping[str, float]:  # noqa: ANN401
    """Give a fixed base a mass and an inertia, if it has none; no number depends on them.

    Returns:
        The mass that was replaced, by the name of the body; empty if none was.
    """
    if not _is_empty(base):
        return {}
    _state(base)
    before = float(base.mass)
    base.mass = max(before, HELD_KG)
    _change(base, HELD_KG)
    notes.lose("{} has no mass or no inertia, but never moves: it gets 1 kg m²", base.name or "the base")
    return {base.name or "body1": before}


def without_mass(body: Any) -> None:  # noqa: ANN401
    """Let a body of a spec have neither mass nor inertia, whatever its shapes are."""
    _state(body)
    body.mass = 0.0
    _change(body, 0.0)


def mend(spec: Any, notes: Notes, moved: set[str], *, allowed: bool) -> Mapping[str, float]:  # noqa: ANN401
    """Replace what no rigid body has, or refuse it.

    Moments that break the triangle inequality become their mean, as by MuJoCo's `balanceinertia`. Moments of zero
    become those of the body's shapes at uniform density, and a mass of zero is that of the shapes at 1000 kg/m³.

    Args:
        spec: MuJoCo's `MjSpec`; its bodies are changed.
        notes: what is said about it.
        moved: names of the bodies with joints.
        allowed: whether to replace it.

    Returns:
        Masses that were replaced, by the names of the bodies.
    """
    empty = []
    is_bounded = min(spec.compiler.boundmass, spec.compiler.boundinertia) > 0  # MuJoCo then gives each body some
    for at, body in enumerate(spec.bodies):
        name = body.name or f"body{at}"
        moments = _moments(body)
        if body.explicitinertial and max(moments) > (sum(moments) - max(moments)) * (1 + ROUNDING):
            given = ", ".join(f"{moment:.4g}" for moment in moments)
            mean = float(np.mean(moments))
            _change(body, mean) if allowed else None
            _note(notes, allowed, f"{name}: moments {given} kg m² break the triangle inequality", f"{mean:.4g} each")
        elif name in moved and not is_bounded and not _carried(body) and _is_empty(body):
            empty.append((at, body, name))
    if not allowed:
        for _, body, name in empty:
            _note(notes, allowed, f"{name} moves, but has mass {body.mass:.4g} kg and a moment of inertia of 0", "")
        return {}
    replaced = {name: float(body.mass) for _, body, name in empty}
    if empty:
        _fill(spec, empty, notes)
    return replaced


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


def _is_empty(body: Any) -> bool:  # noqa: ANN401
    """Return whether a body has no mass or no inertia."""
    if not body.explicitinertial:
        return not _has_mass(body)
    return bool(body.mass <= 0 or min(_moments(body)) <= 0)


def _carried(body: Any) -> bool:  # noqa: ANN401
    """Return whether a massless body has its mass from bodies that are fixed to it."""
    return body.mass <= 0 and any(_has_mass(child) for child in body.bodies if not child.joints)


def _has_mass(body: Any) -> bool:  # noqa: ANN401
    """Return whether a body has mass: its own, that of its shapes, or that of bodies that are fixed to it."""
    has_own = body.mass > 0 if body.explicitinertial else any(map(_is_heavy, body.geoms))
    return has_own or any(_has_mass(child) for child in body.bodies if not child.joints)


def _is_heavy(geom: Any) -> bool:  # noqa: ANN401
    return bool(geom.density > 0 if np.isnan(geom.mass) else geom.mass > 0)


def _state(body: Any) -> None:  # noqa: ANN401
    """Let a body whose mass would be that of its shapes have one of its own, with its centre at the origin."""
    if not body.explicitinertial:
        body.explicitinertial, body.ipos = True, [0.0] * 3


def _fill(spec: Any, empty: list[tuple[int, Any, str]], notes: Notes) -> None:  # noqa: ANN401
    """Give bodies the inertia of their shapes: a copy of the spec is compiled, in which MuJoCo computes it."""
    copy, shaped = spec.copy(), set[int]()
    for at, _, _ in empty:
        twin = copy.bodies[at]
        _change(twin, 1.0)  # MuJoCo refuses the moments of zero even where it does not use them
        if any(map(_is_heavy, twin.geoms)):
            shaped.add(at)
            twin.explicitinertial, twin.ipos = False, [np.nan] * 3  # MuJoCo computes what has no centre of mass
        else:
            _state(twin)
            twin.mass = 1.0
            _change(twin, GYRATION_M**2)
    model = copy.compile()
    for at, body, name in empty:
        found = model.body(at)
        before = body.mass
        _state(body)
        body.mass = float(found.mass[0]) if before <= 0 and at in shaped else max(before, LEAST_KG)
        moments = found.inertia * body.mass / float(found.mass[0])
        _change(body, *moments.tolist())
        body.iquat = found.iquat
        given = ", ".join(f"{moment:.3g}" for moment in moments)
        _note(notes, True, f"{name}: mass {before:.4g} kg, inertia 0", f"{body.mass:.4g} kg and {given} kg m²")
