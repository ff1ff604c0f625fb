"""The CUDA renderer where there is no GPU. On a real one: ``python -m tests.benchmarks gpu.frame``."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fracslice.expr.language import Linked
from fracslice.rendering import cuda
from fracslice.rendering.cuda_loops import loops
from tests.examples import stamped
from tests.kernel.cuda_ptx import compiled
from tests.rendering.cuda_cases import CASES, frame

pytestmark = [
    pytest.mark.once,
    pytest.mark.skipif(importlib.util.find_spec("numba_cuda") is None, reason="numba-cuda is not there"),
]


SIMULATED = "glass and mirrors", "surroundings, a sun that rays meet"
"""Cases of every run; the others are of a night."""


@pytest.mark.parametrize("name", stamped(CASES, SIMULATED))
def test_float32_kernels_hold_no_float64(name: str, tmp_path: Path) -> None:
    seen = frame(name)
    ptx = compiled(seen.linked, 32, loops(seen), "tile", "RNRIRnrn", tmp_path)
    assert ".f64" not in ptx
    assert ".f32" in ptx


@pytest.mark.parametrize(
    ("name", "arguments"),
    [("measure", "RRM"), ("judge", "RRRMnrrr"), ("choose", "RRMrr"), ("show", "RUnnrrrrn")],
)
def test_what_keeps_the_picture_holds_no_float64(name: str, arguments: str, tmp_path: Path) -> None:
    ptx = compiled(Linked("", np.zeros(1)), 32, cuda.LOOPS, name, arguments, tmp_path)
    assert ".f64" not in ptx
    assert ".f32" in ptx


def test_threads_go_on_together_after_the_march(tmp_path: Path) -> None:
    """Without the barrier those that hit first shade alone, and a frame takes twice as long."""
    seen = frame("fractal")
    assert "bar.warp.sync" in compiled(seen.linked, 32, loops(seen), "tile", "RNRIRnrn", tmp_path)


@pytest.mark.parametrize("names", [SIMULATED, pytest.param((), marks=pytest.mark.nightly)])
def test_pictures_are_those_of_the_lanes_on_the_simulator(names: tuple[str, ...]) -> None:
    """Some of them, or all."""
    environment = {**os.environ, "NUMBA_ENABLE_CUDASIM": "1"}
    command = [sys.executable, "-m", "tests.rendering.cuda_simulated", *names]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
