"""Trial of a formula at random points: back ends, derivative of the step, Lipschitz constant and box."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.parameters import AUTO, REQUIRED
from ..errors import SceneError
from .cpu import compile_scene
from .orbit_code import function_of_text
from .orbits import growth_of, orbit_select, steps
from .reference import reference
from .registry import Formula, Node, get

COUNT, STEPS = 20_000, 6
"""Random points, and the iterations of a trial where the depth is automatic."""

NEAR, CREASES = 1e-6, 0.002
"""Distance of the points that a step's stretch is examined with, and the share of points that may lie at its
creases.
"""

TOLERANCE = {"float64": 1e-9, "float32": 1e-3}
"""Differences from the reference, relative to values above 1."""


@dataclass(frozen=True)
class Trial:
    """Results of a trial."""

    lines: tuple[str, ...]  # one line per examination
    faults: int  # number of examinations that failed
    root: Node  # node that was examined


def trial(formula: Formula) -> Trial:
    """Examine a formula with its default values."""
    root = _sample(formula)
    box, rng = root.bounds.box, np.random.default_rng(0)
    lo, hi = (
        np.clip(corner, -2.0, 2.0) if not box.finite else np.array(corner) for corner in (box.lo, box.hi)
    )
    size = np.maximum(hi - lo, 1e-9)
    points = rng.uniform(lo - 0.25 * size, hi + 0.25 * size, (COUNT, 3)).T
    expected = reference(root)(*points)
    results = [_parity(root, points, expected, "float64"), _parity(root, points, expected, "float32")]
    if "step" in formula.hooks:
        results.append(_derivative(root, points))
    if formula.hooks.get("select") is orbit_select:
        results.append((True, _proofs(root)))
    values = compile_scene(root, "float64").points(*points)
    results += [_check_lipschitz(root, points, values), _box(root, lo, hi, points, values)]
    inside = float((values < 0).mean())
    results.append((0 < inside < 1, f"inside: {inside:.1%} of the points in and around the box"))
    lines = [f"{'ok   ' if good else 'FAULT'} {line}" for good, line in results]
    return Trial(tuple(lines), sum(not good for good, _ in results), root)


def _sample(formula: Formula) -> Node:
    """Node of a formula with its defaults."""
    for name, kind in formula.parameters.items():
        if kind.default is REQUIRED:
            raise SceneError(f"<{formula.name}> {name} has no default: expected one, for a trial")
    depths: dict[str, Any] = {
        name: STEPS for name, kind in formula.parameters.items() if kind.default == AUTO
    }
    return formula(*(get("sphere")() for _ in range(formula.children[0])), **depths)


def _parity(root: Node, points: np.ndarray, expected: np.ndarray, precision: str) -> tuple[bool, str]:
    """Comparison with the reference; creases of float32 orbits are few points with other values."""
    values = compile_scene(root, precision).points(*points)  # type: ignore[arg-type]
    error = np.abs(values - expected) / np.maximum(np.abs(expected), 1.0)
    typical = float(np.quantile(error, 0.99))
    good = bool(np.isfinite(values).all()) and typical < TOLERANCE[precision]
    return good, f"{precision}: 99% of the values within {typical:.1e} of the reference"


def _check_lipschitz(root: Node, points: np.ndarray, values: np.ndarray) -> tuple[bool, str]:
    """Search for points inside the balls that the Lipschitz bound excludes."""
    bound, outside = root.bounds.lipschitz, values > 0
    step = np.random.default_rng(2).normal(size=points.shape)
    step *= 0.999 * np.abs(values) / bound / np.linalg.norm(step, axis=0)
    field = compile_scene(root, "float64").points
    broken = int((field(*(points + step))[outside] < -1e-9).sum())
    line = f"bound L = {bound:g}: broken at {broken} of {outside.sum()}"
    if not broken or root.bounds.exterior_only:
        return not broken, line
    near = points + NEAR * step / np.linalg.norm(step, axis=0)
    slope = np.abs(field(*near) - values).max() / NEAR
    return False, f"{line}; slopes up to {slope:.3g}: expected a larger lipschitz"


def _box(
    root: Node, lo: np.ndarray, hi: np.ndarray, points: np.ndarray, values: np.ndarray
) -> tuple[bool, str]:
    """Search for points inside the solid and outside its bounding box."""
    if not root.bounds.box.finite:
        return True, "no bounding box: the solid is endless; @formula.bounds declares one"
    beyond = ((lo > points.T) | (hi < points.T)).any(axis=1)
    lost = int((values[beyond] < 0).sum())
    shown = " x ".join(f"{s:.4g}" for s in root.bounds.box.size)
    return not lost, f"box {shown}: {lost} of {beyond.sum()} points beyond it are inside"


def _proofs(root: Node) -> str:
    """Radius of escape and bound of an orbit, and whether they are proved."""
    bound = growth_of(root)
    radius, slope = ("proved" if proved else "measured" for proved in (bound.proved, bound.lipschitz))
    return f"radius of escape {bound.escape:.4g}: {radius}; L = {root.bounds.lipschitz:g}: {slope}"


def _derivative(root: Node, points: np.ndarray) -> tuple[bool, str]:
    """Comparison of a step's stretch with the distances of its images."""
    taken, values = steps(root)
    code = taken[0]
    made, names = code.traced(0), code.arguments(0)
    image = f"return ({', '.join(made.point)}), {made.stretch[0]}"
    body = [*code.before(0, ("px", "py", "pz")), *made.lines, image]
    step = function_of_text(taken, ["x", "y", "z", "px", "py", "pz", *names], body)
    given = [values[name] for name in names]
    offset = np.random.default_rng(1).normal(size=points.shape)
    offset *= NEAR / np.linalg.norm(offset, axis=0)
    with np.errstate(all="ignore"):
        here, stretch = step(*points, *points, *given)
        there, _ = step(*(points + offset), *points, *given)
        moved = np.linalg.norm(np.array(np.broadcast_arrays(*there)) - np.broadcast_arrays(*here), axis=0)
        broken = float((moved > NEAR * (1.001 * np.asarray(stretch) + 1e-3)).mean())
    return broken < CREASES, f"derivative of the step: too small at {broken:.1%} of the points"
