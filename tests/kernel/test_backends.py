"""One suite, stamped on every formula and every back end: the reference decides."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.fields.linker import FIELD, link
from fracslice.formulas import mandelbulb, sphere
from tests.examples import DEFINED, EXAMPLES, stamped

pytestmark = pytest.mark.once

ALL = EXAMPLES | DEFINED

# Largest error in units of the last place of the largest coordinate, times the conditioning of the longest
# orbit.
TOLERANCE = {"float32": 2e-5, "float64": 1e-13}
PRECISIONS = ["float32", "float64"]


def random_points(dtype: str, count: int = 5000) -> np.ndarray:
    points = np.random.default_rng(5).uniform(-1.6, 1.6, (3, count))
    return points.astype(dtype).astype(np.float64)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", stamped(ALL))
class TestAgainstTheReference:
    def test_random_points(self, name: str, precision: str) -> None:
        points = random_points(precision)
        expected = reference(ALL[name])(*points)
        got = compile_scene(ALL[name], precision).points(*points)  # type: ignore[arg-type]
        assert got.dtype == precision
        np.testing.assert_allclose(got, expected, rtol=TOLERANCE[precision], atol=TOLERANCE[precision])

    def test_poles_axes_and_origin(self, name: str, precision: str) -> None:
        r = np.linspace(-1.5, 1.5, 31).astype(precision).astype(np.float64)
        o, tiny = np.zeros_like(r), np.full_like(r, 1e-7)
        points = np.concatenate([[r, o, o], [o, r, o], [o, o, r], [tiny, o, r], [r, r, o], [o, o, o]], axis=1)
        expected = reference(ALL[name])(*points)
        got = compile_scene(ALL[name], precision).points(*points)  # type: ignore[arg-type]
        np.testing.assert_allclose(got, expected, rtol=1e-3, atol=TOLERANCE[precision] * 10)

    def test_denormal_points_are_the_origin(self, name: str, precision: str) -> None:
        kernel = compile_scene(ALL[name], precision)  # type: ignore[arg-type]
        zero, tiny = np.zeros(3), np.full(3, 1e-42 if precision == "float32" else 5e-324)
        np.testing.assert_allclose(kernel.points(*tiny[:, None]), kernel.points(*zero[:, None]), atol=1e-6)

    def test_far_points_are_outside(self, name: str, precision: str) -> None:
        root = ALL[name]
        far = np.random.default_rng(1).normal(size=(3, 64)) * np.logspace(1, 18, 64)
        outside = compile_scene(root, precision).points(*far) > 0  # type: ignore[arg-type]
        assert (outside == (reference(root)(*far) > 0)).all()
        assert outside.all() or not root.bounds.box.finite

    def test_nan_and_infinity_are_never_inside(self, name: str, precision: str) -> None:
        kernel = compile_scene(ALL[name], precision)  # type: ignore[arg-type]
        bad = np.array([(np.nan, 0, 0), (0, np.nan, 0), (0, 0, np.nan), (np.nan,) * 3], float).T
        assert np.isnan(kernel.points(*bad)).all()
        if ALL[name].bounds.box.finite:
            endless = np.array(
                [(np.inf, 0, 0), (0, -np.inf, 0), (0, 0, np.inf), (np.inf, np.inf, -np.inf)], float
            ).T
            assert not (kernel.points(*endless) < 0).any()

    def test_a_value_depends_on_its_point_alone(self, name: str, precision: str) -> None:
        """Bit for bit the same whatever is in the other lanes, and through the brick loop."""
        kernel, voxel = compile_scene(ALL[name], precision), 0.125  # type: ignore[arg-type]
        corners = np.array([(0, 0, 0), (8, 0, 16), (16, 8, 8)], np.int32)
        out = np.empty((3, 512), precision)
        kernel.bricks(corners, (-1.5, -1.25, -1.375), voxel, out)
        index = corners[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T
        points = np.array([-1.5, -1.25, -1.375]) + voxel * index.reshape(-1, 3)
        shuffled = np.random.default_rng(0).permutation(len(points))
        alone = kernel.points(*points[shuffled].T)
        assert (alone == out.ravel()[shuffled]).all()


def test_editing_a_value_does_not_change_the_code() -> None:
    a, b = link(mandelbulb(iterations=5)), link(mandelbulb(iterations=9, bailout=3))
    assert a.program == b.program and not np.array_equal(a.parameters, b.parameters)


def test_only_what_is_used_is_linked() -> None:
    from fracslice.formulas import transform

    plain = link(sphere()).program
    assert link(transform(sphere())).program == plain
    assert [part.name for part in plain.parts] == ["N0"] and list(plain.functions) == [FIELD]


def test_second_process_compiles_nothing(tmp_path, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    import subprocess
    import sys

    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path))
    script = (
        "import sys; from fracslice.formulas import julia; from fracslice.fields.cpu import compile_scene;"
        "compile_scene(julia(iterations=5)).points([0.1], [0.2], [0.3]);"
        "print('fracslice.expr.emitter' in sys.modules, 'numba' in sys.modules)"
    )
    runs = [
        subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert [r.strip() for r in runs] == ["True False", "False False"]
    assert len(list(tmp_path.glob("*.o"))) == 1
