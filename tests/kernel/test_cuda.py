"""The CUDA back end where there is no GPU: what it compiles to, and what it computes on Numba's simulator.

On a real GPU: ``python -m tests.benchmarks gpu.parity``.
"""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fracslice.errors import KernelError
from fracslice.expr import cuda_loops, cuda_source
from fracslice.fields import cuda
from fracslice.fields.linker import link
from fracslice.formulas import Node, sphere
from tests.examples import DEFINED, EXAMPLES, OF_FILES, STRUCTURES, stamped
from tests.kernel.cuda_ptx import compiled

pytestmark = pytest.mark.once

installed = pytest.mark.skipif(
    importlib.util.find_spec("numba_cuda") is None, reason="numba-cuda is not installed"
)


SIMULATED = "hybrid transformed", "menger", "smooth union"
"""Examples that are run on the simulator in every run; the others in a night."""


@installed
class TestMachineCode:
    """PTX for an H100 or H200, which needs no GPU to be compiled."""

    @pytest.mark.parametrize(
        "name", stamped([n for n in EXAMPLES | DEFINED if n not in OF_FILES], STRUCTURES)
    )
    def test_float32_kernels_hold_no_float64(self, name: str, tmp_path: Path) -> None:
        ptx = points_of((EXAMPLES | DEFINED)[name], 32, tmp_path)
        assert ".f32" in ptx
        assert ".f64" not in ptx

    @pytest.mark.parametrize("name", ["sphere", "repeat", "mandelbulb", "mandelbulb 7.5", "twist"])
    def test_float64_kernels_compute_in_float64(self, name: str, tmp_path: Path) -> None:
        instructions = re.findall(
            r"(?:add|sub|mul|fma)\S*\.(f32|f64)", points_of(EXAMPLES[name], 64, tmp_path)
        )
        assert set(instructions) == {"f64"}

    @pytest.mark.parametrize("name", ["mandelbulb", "menger", "union"])
    def test_everything_is_inlined_into_registers(self, name: str, tmp_path: Path) -> None:
        ptx = points_of(EXAMPLES[name], 32, tmp_path)
        assert "call" not in ptx
        assert ".local" not in ptx

    def test_nothing_assumes_that_there_is_no_nan(self, tmp_path: Path) -> None:
        assert "setp.nan" in points_of(EXAMPLES["mandelbulb"], 32, tmp_path)


def points_of(root: Node, bits: int, folder: Path) -> str:
    """The PTX of the loop over points."""
    return compiled(link(root), bits, [cuda_loops.points], "points", "RRRRR", folder)


@installed
@pytest.mark.parametrize("names", [SIMULATED, pytest.param((), marks=pytest.mark.nightly)])
def test_examples_agree_with_the_reference_on_the_simulator(names: tuple[str, ...]) -> None:
    """Some of them, or all."""
    # The simulator is chosen when Numba is imported, so it needs a process of its own.
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1"}
    command = [sys.executable, "-m", "tests.kernel.cuda_simulated", *names]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@installed
def test_without_a_gpu_one_line_says_so() -> None:
    if cuda.available():
        pytest.skip("this machine has a GPU")
    with pytest.raises(KernelError, match="no NVIDIA GPU, or no driver"):
        cuda.compile_scene(sphere())


def test_without_numba_cuda_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert not cuda.available()
    with pytest.raises(KernelError, match=r'pip install "numba-cuda\[cu13\]"'):
        cuda.compile_scene(sphere())


def test_asking_for_nothing_imports_nothing() -> None:
    script = "import sys, fracslice.fields.cuda; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


class TestTyping:
    """Numbers of the formulas' text as the CUDA module says them."""

    @pytest.mark.parametrize(
        ("formula", "thread"),
        [
            ("return x / 2 - 1", "return divide(x, real(2)) - real(1)"),
            ("return where(x < 1, P[3], -2)", "return where(x < real(1), P[3], real(-2))"),
            ("return 0.0 * x + 1.5", "return real(0.0) + real(1.5)"),
            ("return True", "return True"),
            ("return (x >> 8 & 255) * 0.5", "return real(x >> 8 & 255) * real(0.5)"),
            ("x, y = 0, x\n    return y", "x, y = (real(0), x)\n    return y"),
        ],
    )
    def test_of_numbers(self, formula: str, thread: str) -> None:
        text = cuda_source.typed(f"def f(x, P):\n    {formula}")
        assert text == f"@device\ndef f(x, P):\n    {thread}\n"

    def test_of_loops_whose_counter_is_assigned(self) -> None:
        loop = "def f(x, P):\n    for _ in range(3):\n        x, _ = (x, 1.0)"
        assert cuda_source.typed(loop) == (
            "@device\ndef f(x, P):\n    __count = whole(0)\n    while __count < whole(3):\n"
            "        x, _ = (x, real(1.0))\n        __count = whole(__count + 1)\n"
        )
        read = loop.replace("_", "i").replace("1.0", "i")
        assert "\n        i = i_count\n        x, i = (x, i)\n" in cuda_source.typed(read).replace(
            "real(i)", "i"
        )

    def test_of_loops(self) -> None:
        loop = "def f(x, P):\n    for i in range(int(P[1])):\n        x = 2.0 if i % 2 == 1 else x + (i - 1)"
        assert cuda_source.typed(loop) == (
            "@device\ndef f(x, P):\n    i = whole(0)\n    while i < whole(P[1]):\n"
            "        x = real(2.0) if i % 2 == 1 else x + real(i - 1)\n        i = whole(i + 1)\n"
        )
