"""The CUDA back end where there is no GPU: what it compiles to, and what its threads compute on the CPU.

On a real GPU: ``python -m tests.benchmarks gpu.parity``.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fracslice.errors import KernelError
from fracslice.expr import cuda_driver
from fracslice.expr.emitter import compile_ptx
from fracslice.expr.loops import bricks, points
from fracslice.fields import cuda
from fracslice.fields.devices import reference
from fracslice.fields.field import Precision
from fracslice.fields.linker import link
from fracslice.fields.node import FORMULAS
from fracslice.formulas import Node, sphere
from fracslice.mesh.roots import LOOPS, Roots
from tests.examples import DEFINED, EXAMPLES, OF_FILES, STRUCTURES, stamped
from tests.kernel.cuda_host import H200, HostDriver, runs_on_cpu
from tests.kernel.idioms import HEAD, SAME, P, imported

pytestmark = pytest.mark.once

KNOWN = EXAMPLES | DEFINED
TOLERANCE = {"float32": 2e-5, "float64": 1e-13}
MOST = {"sphere": 70, "mandelbulb": 165, "mandelbulb 7.5": 330, "julia": 125, "menger": 185}
"""Instructions of the loop over bricks in float32."""


def ptx(root: Node, bits: int, loop: str = "bricks") -> str:
    """The PTX of a loop for an H100 or H200, which needs no GPU to be compiled."""
    text = compile_ptx(link(root).program, bits, H200, (points, bricks)).decode()
    return text.split(f".entry {loop}(")[1].split(".entry")[0]


class TestMachineCode:
    @pytest.mark.parametrize("name", stamped([n for n in KNOWN if n not in OF_FILES], STRUCTURES))
    def test_float32_kernels_hold_no_float64(self, name: str) -> None:
        text = ptx(KNOWN[name], 32)
        assert ".f32" in text
        assert ".f64" not in text

    @pytest.mark.parametrize("name", ["sphere", "repeat", "mandelbulb", "mandelbulb 7.5", "twist"])
    def test_float64_kernels_compute_in_float64(self, name: str) -> None:
        instructions = re.findall(r"(?:add|sub|mul|fma)\S*\.(f32|f64)", ptx(EXAMPLES[name], 64))
        assert set(instructions) == {"f64"}

    @pytest.mark.parametrize("name", ["mandelbulb", "menger", "union"])
    def test_everything_is_inlined_into_registers(self, name: str) -> None:
        text = ptx(EXAMPLES[name], 32)
        assert "call" not in text
        assert ".local" not in text

    @pytest.mark.parametrize("name", MOST)
    def test_loops_are_short(self, name: str) -> None:
        assert len(re.findall(r"(?m)^\t[@%a-z].*;$", ptx(EXAMPLES[name], 32))) <= MOST[name]

    def test_products_may_be_fused_with_sums(self) -> None:
        assert not re.search(r"(?:add|sub|mul)\.rn", ptx(EXAMPLES["mandelbulb"], 32))

    def test_extremes_of_nan_are_nan(self) -> None:
        text = ptx(EXAMPLES["union"], 32)
        assert "min.NaN.f32" in text
        assert "min.f32" not in text

    @pytest.mark.parametrize(("capability", "target"), [((99, 0), "120"), ((8, 7), "86"), ((5, 2), "50")])
    def test_a_gpu_gets_the_code_of_the_newest_that_llvm_knows(
        self, capability: tuple[int, int], target: str, capfd: pytest.CaptureFixture[str]
    ) -> None:
        text = compile_ptx(link(EXAMPLES["union"]).program, 32, capability, (points,)).decode()
        assert f".target sm_{target}" in text
        assert capfd.readouterr() == ("", "")


@pytest.fixture
def threads(monkeypatch: pytest.MonkeyPatch) -> Iterator[HostDriver]:
    yield from runs_on_cpu(monkeypatch)


@pytest.mark.usefixtures("threads")
class TestThreads:
    """One after the other on the CPU."""

    @pytest.mark.parametrize("precision", ["float32", pytest.param("float64", marks=pytest.mark.nightly)])
    @pytest.mark.parametrize("name", stamped(KNOWN, STRUCTURES))
    def test_of_points_agree_with_the_reference(self, name: str, precision: Precision) -> None:
        kernel = cuda.CudaKernel(link(KNOWN[name]), precision)
        p = np.random.default_rng(3).uniform(-1.6, 1.6, (3, 64)).astype(precision)
        p[:2, 0] = 0.0
        with np.errstate(all="ignore"):
            expected = reference(KNOWN[name])(*p)
        got, small = kernel.points(*p), TOLERANCE[precision]
        assert got.dtype == precision
        np.testing.assert_allclose(got, expected, rtol=small, atol=small)
        bad = np.array([(np.nan, 0, 0), (0, np.nan, 0), (0, 0, np.nan)]).T
        assert np.isnan(kernel.points(*bad)).all()

    def test_of_idioms_mean_the_same(self, tmp_path: Path) -> None:
        known = dict(FORMULAS)
        for number, (body, expected) in enumerate(SAME.items()):
            root = imported(f"{HEAD}    {body}", tmp_path, f"idiom{number}").mine(radius=0.7)
            got = cuda.CudaKernel(link(root), "float64").points(*P)
            np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12, err_msg=body)
            FORMULAS.clear()
            FORMULAS.update(known)

    def test_of_bricks_have_the_values_at_their_points(self) -> None:
        kernel = cuda.CudaKernel(link(EXAMPLES["capsule"]))
        corners, out = np.array([(0, 0, 0), (8, 0, 16), (16, 8, 8)], np.int32), np.empty((3, 512), np.float32)
        kernel.bricks(corners, (-1.5, -1.25, -1.375), 0.125, out)
        index = corners[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T
        alone = kernel.points(*np.moveaxis(np.array([-1.5, -1.25, -1.375]) + 0.125 * index, -1, 0))
        np.testing.assert_array_equal(alone, out)
        assert kernel.points(*np.empty((3, 0))).shape == (0,)
        kernel.bricks(corners[:0], (0, 0, 0), 1.0, out[:0])

    def test_of_lanes_find_the_roots_and_normals_of_the_lanes(self) -> None:
        root = EXAMPLES["mandelbulb"]
        width = Roots(root, "float32", 0.02).width
        directions = np.random.default_rng(5).normal(size=(3, width))
        directions /= np.linalg.norm(directions, axis=0)
        segments = np.concatenate([0.1 * directions, 2.0 * directions])
        for precision, tolerance in (("float32", 1e-4), ("float64", 1e-9)):
            rows = segments.astype(precision)
            finders = [Roots(root, precision, 0.02, device) for device in ("cpu", "cuda")]
            expected, computed = (ran(finder, "find", rows, 1)[0] for finder in finders)
            assert ((expected > 0) & (expected < 1)).all()
            np.testing.assert_allclose(computed, expected, atol=tolerance)
        polished = [np.tile(expected, (5, 1)) for _ in range(2)]
        for out, device in zip(polished, ("cpu", "cuda"), strict=True):
            root.loops(LOOPS["float64"], "float64", device).runs["polish"](finders[0].frame, rows, out)
        np.testing.assert_allclose(*polished, atol=1e-5)
        regions = np.full((15, width), np.nan)
        regions[:3], regions[3:9] = directions, 0.1
        finders = [Roots(root, "float32", 0.02, device) for device in ("cpu", "cuda")]
        guesses = [ran(finder, "lead", regions.astype(np.float32), 3) for finder in finders]
        np.testing.assert_allclose(*guesses, atol=1e-3)


def ran(finder: Roots, name: str, rows: np.ndarray, count: int) -> np.ndarray:
    """Rows that a loop writes."""
    out = np.empty((count, rows.shape[1]), finder.dtype)
    finder.runs[name](finder.frame, rows, out)
    return out


def test_without_a_driver_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def not_found(name: str) -> None:
        raise OSError(name)

    monkeypatch.setattr(ctypes, "CDLL", not_found)
    cuda_driver._driver.cache_clear()
    try:
        assert not cuda_driver.available()
        with pytest.raises(
            KernelError, match=r"^CUDA: no NVIDIA GPU, or no driver for it, was found on this machine$"
        ):
            cuda.CudaKernel(link(sphere()))
    finally:
        cuda_driver._driver.cache_clear()


def test_asking_for_nothing_imports_nothing() -> None:
    script = "import sys, fracslice.fields.cuda; print('llvmlite.binding' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
