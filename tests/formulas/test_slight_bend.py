"""A slight bend has its centre far away; in float32 the shape must survive that."""

import numpy as np
import pytest

from fracslice.fields.cpu import compile_scene
from fracslice.formulas import bend, box

pytestmark = pytest.mark.once


@pytest.mark.parametrize("degrees", [1e-12, 1e-6, 1e-3, 0.1, -0.1])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_slight_bend_changes_little(degrees, axis):
    points = np.random.default_rng(0).uniform(-1, 1, (3, 1000)).astype(np.float32)
    straight = compile_scene(box()).points(*points)
    bent = compile_scene(bend(box(), degrees=degrees, axis=axis)).points(*points)
    certain = np.abs(straight) > 2 * np.radians(abs(degrees)) + 1e-6
    assert ((bent < 0) == (straight < 0))[certain].all()
    assert (np.abs(bent) > 0.1 * np.abs(straight))[np.abs(straight) > 0.01].all()
