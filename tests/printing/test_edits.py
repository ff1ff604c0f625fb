"""A scene with changes: what space is skipped by."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from fracslice.formulas import mandelbulb, sphere, transform
from fracslice.mesh import Mesh
from fracslice.mesh.models import MeshField
from fracslice.printing.edits import EditedField

pytestmark = pytest.mark.once

TORN = mandelbulb(iterations=4, power=7.5)


def test_the_guard_of_a_changed_scene_is_less() -> None:
    """By a cut of something torn as well: guarding that would make more of the rest."""
    aside = transform(TORN, translate=(0.6, 0, 0))
    changed = EditedField(EditedField(TORN, "add", sphere(radius=0.5)), "cut", aside)
    points = np.random.default_rng(0).uniform(-1.3, 1.3, (3, 50_000))
    own, conservative = (
        field.kernel("cpu", "float64").points(*points) for field in (changed, changed.conservative())
    )
    outside = own > 0
    assert (conservative <= own + 1e-12)[outside].all() and (conservative < own - 1e-3)[outside].any()
    alone = EditedField(sphere(), "cut", aside)
    same = (field.kernel("cpu", "float64").points(*points) for field in (alone, alone.conservative()))
    np.testing.assert_array_equal(*same)


def test_the_work_on_an_edited_mesh_is_planned_for_its_slow_values() -> None:
    """Samples that resolve thin walls were as many as of a formula: eight times too many."""
    shape = trimesh.creation.icosphere(2)
    ball = MeshField(Mesh(shape.vertices.astype(np.float64), shape.faces.astype(np.int32)))
    for edited in (EditedField(ball, "cut", sphere(radius=0.9)), EditedField(sphere(), "cut", ball)):
        assert edited.kernel().batch == ball.kernel().batch < sphere().kernel().batch
