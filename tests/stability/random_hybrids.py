"""Random hybrids of all registered orbits, sampled sparsely and densely."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from fracslice.common.parameters import REQUIRED, Choice, Count, Number, Vector
from fracslice.errors import SceneError, VolumeError
from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.fields.orbits import ITERATIONS
from fracslice.formulas import Formula, Node, orbit, transform
from fracslice.scene.layout import formulas
from fracslice.volume import Plan, plan, sample_scene
from fracslice.volume.bricks import INSIDE

from .draws import number

ORBITS = [f for f in formulas() if "step" in f.hooks]
TRIES, LOOKED, LEAST = 100, 4000, 40
OF_THE_WHOLE = {"iterations", "bailout", "julia"}


def random_hybrid(seed: int) -> Node:
    """A hybrid of one to three steps whose orbits escape; always the same for the same seed."""
    rng = np.random.default_rng(seed)
    for _ in range(TRIES):
        with suppress(SceneError):
            root = hybrid(rng)
            if _inside(root):
                return root
    raise AssertionError(f"seed {seed}: no hybrid escapes")


def hybrid(rng: np.random.Generator) -> Node:
    """A hybrid of one to three steps, whose orbits may stay."""
    count = int(rng.integers(1, 4))
    return orbit(*(_step(rng) for _ in range(count)), iterations=int(rng.integers(2, 5)), **_julia(rng))


def _inside(root: Node) -> bool:
    """True if some of the points in the box are inside."""
    points = np.random.default_rng(0).uniform(root.bounds.box.lo, root.bounds.box.hi, (LOOKED, 3))
    return int((reference(root)(*points.T) < 0).sum()) > LEAST


def _step(rng: np.random.Generator) -> Node:
    formula = ORBITS[rng.integers(len(ORBITS))]
    values = {
        name: _value(rng, kind) for name, kind in formula.parameters.items() if name not in OF_THE_WHOLE
    }
    step = formula(**values, **_own(rng, formula))
    if rng.uniform() < 0.6:
        return step
    turn = (*rng.normal(size=3).tolist(), float(rng.uniform(0, 360)))
    scale = float(2 ** rng.uniform(-0.5, 0.5))
    return transform(step, rotate=turn, scale=scale, translate=tuple(rng.uniform(-0.2, 0.2, 3).tolist()))


def _own(rng: np.random.Generator, formula: Formula) -> dict[str, object]:
    return _julia(rng) if "julia" in formula.parameters else {}


def _julia(rng: np.random.Generator) -> dict[str, object]:
    return {"julia": tuple(rng.uniform(-0.5, 0.5, 3).tolist())} if rng.uniform() < 0.2 else {}


def _value(rng: np.random.Generator, kind: object) -> object:
    """A value near the default of a step's parameter; a vector of four ends in zero, for planes of points."""
    if isinstance(kind, Count):
        return int(rng.integers(1, 3)) if kind is not ITERATIONS else kind.default
    if isinstance(kind, Choice):
        return kind.choices[rng.integers(len(kind.choices))]
    assert isinstance(kind, (Number, Vector)) and kind.default is not REQUIRED
    if isinstance(kind, Number):
        return float(round(number(kind, kind.default, rng, 1.0)))
    drawn = tuple(number(kind, v, rng, 1.0) for v in kind.default)
    return (*drawn[:3], 0.0) if len(drawn) == 4 else drawn


def lost(root: Node, resolution: float, proved: bool = False) -> int:
    """Grid points inside the solid that are outside by its sparse samples, or skipped by proofs alone."""
    planned = plan(root, resolution)
    planned = planned.strict if proved else planned
    try:
        bricks = sample_scene(planned)
    except VolumeError:  # all of it is thinner than a voxel
        return int((dense(planned) < 0).sum())
    values = dense(planned)
    rows = bricks.index.reshape(-1)
    sampled, inside = rows >= 0, values < 0
    known = np.where(sampled[:, None], bricks.values[np.maximum(rows, 0)] < 0, (rows == INSIDE)[:, None])
    return int((inside & ~known).sum())


def dense(planned: Plan) -> np.ndarray:
    """Values on all grid points, one row per brick."""
    lattice = planned.lattice
    corners = np.indices(lattice.bricks, np.int32).reshape(3, -1).T * np.int32(8)
    values = np.empty((len(corners), 512), np.float32)
    compile_scene(planned.root).bricks(np.ascontiguousarray(corners), lattice.origin, lattice.voxel, values)
    return values
