"""The program that `gpu.frame` gives to nvcc, built for the host: the same picture as the renderer's."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from fracslice.rendering.accumulator import tile_order
from tests.benchmarks.gpu import frame as gpu
from tests.benchmarks.gpu.cpp import translated

pytestmark = pytest.mark.once

COMPILER = shutil.which("g++") or shutil.which("clang++")


@pytest.mark.skipif(COMPILER is None, reason="no C++ compiler")
def test_the_program_draws_the_picture_of_the_renderer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    width, height = 96, 54
    for name, value in {"WIDTH": width, "HEIGHT": height, "TIMES": 1}.items():
        monkeypatch.setattr(gpu, name, value)
    seen, pixels = gpu.frame(width, height), tile_order(width, height)
    gpu.given(seen, pixels).tofile(tmp_path / "given")
    launched = re.sub(r"tile<<<(.+?), 128>>>\((.+?)\);", r"launch(\1, [&] { tile(\2); });", gpu.program(seen))
    text = translated(seen.linked.program, seen.linked.parameters.tolist()) + launched
    header = Path(gpu.__file__).with_name("host.h")
    (tmp_path / "program.cpp").write_text(f'#include "{header}"\n{text}')
    binary = tmp_path / "program"
    command = [COMPILER, "-O0", "-std=c++17", "-w", tmp_path / "program.cpp", "-o", binary]
    subprocess.run(command, check=True)  # type: ignore[arg-type]
    words = [str(binary), str(tmp_path / "given"), str(width), str(height)]
    _, mean, error = map(
        float, subprocess.run(words, check=True, capture_output=True, text=True).stdout.split()
    )
    assert error == 0
    assert mean == pytest.approx(float(gpu.on_cpu(seen, pixels)[:, 3].mean()), rel=5e-4)
    assert mean > 0.1 and np.isfinite(mean)
