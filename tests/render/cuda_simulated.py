"""Run by test_cuda.py in a process of its own, on Numba's CUDA simulator, against the lanes."""

from __future__ import annotations

import numpy as np

from fracslice.render.cpu import CpuTracer, ordered
from fracslice.render.cuda import CudaTracer
from fracslice.work import Work
from tests.render.cuda_cases import CASES, HEIGHT, WIDTH, frame

SAMPLE, LIMIT = 65, 128


def main() -> None:
    single = np.dtype(np.float32)
    for name in CASES:
        pictures = []
        for tracer in (CpuTracer, CudaTracer):
            sums = np.zeros((HEIGHT * WIDTH, 6), single)
            made = tracer(frame(name), single, WIDTH, HEIGHT)
            made.look_ahead(LIMIT, Work(1))
            made.add(sums, ordered(WIDTH, HEIGHT), SAMPLE, LIMIT, Work(1))
            pictures.append(sums)
        cpu, gpu = pictures
        # A ray that grazes an edge may fall on either side of it.
        alike = np.isclose(cpu, gpu, rtol=1e-3, atol=1e-3).all(1).mean()
        assert alike > 0.97, f"{name}: {alike:.3f} of the pixels are alike"
        assert cpu[:, 3].std() > 0.01, f"{name}: there is nothing to see"


if __name__ == "__main__":
    with np.errstate(all="ignore"):
        main()
