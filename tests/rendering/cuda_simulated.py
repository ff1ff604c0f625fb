"""Run by test_cuda.py in a process of its own, on Numba's CUDA simulator, against the lanes."""

from __future__ import annotations

import numpy as np

from fracslice.kernel.cuda import require
from fracslice.rendering.accumulator import HostAccumulator
from fracslice.rendering.cpu import CpuTracer, ordered
from fracslice.rendering.cuda import CudaTracer
from fracslice.rendering.cuda_accumulator import CudaAccumulator
from fracslice.scene.view import Film
from fracslice.work import Work
from tests.rendering.cuda_cases import CASES, HEIGHT, WIDTH, frame

SAMPLE, LIMIT = 65, 128
SINGLE = np.dtype(np.float32)


def kernels() -> None:
    for name in CASES:
        sums = [np.zeros((HEIGHT * WIDTH, 6), SINGLE) for _ in range(2)]
        for filled in sums:
            filled[:, 5] = SAMPLE
        cpu, gpu = (
            CpuTracer(frame(name), SINGLE, WIDTH, HEIGHT),
            CudaTracer(frame(name), SINGLE, WIDTH, HEIGHT),
        )
        cpu.look_ahead(LIMIT, Work(1)), gpu.look_ahead(LIMIT, Work(1))
        cpu.add(sums[0], ordered(WIDTH, HEIGHT), SAMPLE, LIMIT, Work(1))
        placed, pixels = (require().to_device(a) for a in (sums[1], ordered(WIDTH, HEIGHT)))
        gpu.add(placed, pixels, SAMPLE, LIMIT, Work(1))
        placed.copy_to_host(sums[1])
        # A ray that grazes an edge may fall on either side of it.
        alike = np.isclose(*sums, rtol=1e-3, atol=1e-3).all(1).mean()
        assert alike > 0.97, f"{name}: {alike:.3f} of the pixels are alike"
        assert sums[0][:, 3].std() > 0.01, f"{name}: there is nothing to see"


def accumulators() -> None:
    """Statistics, choice and tones of the same sums."""
    rng = np.random.default_rng(3)
    host = HostAccumulator.empty(WIDTH, HEIGHT, SINGLE)
    gpu = CudaAccumulator.of(host)
    assert (gpu.wanted(9, 0.1)[0].copy_to_host() == host.wanted(9, 0.1)[0]).all()
    n = 2.0 ** rng.integers(3, 6, WIDTH * HEIGHT) + rng.integers(0, 2, WIDTH * HEIGHT)
    bright = rng.beta(0.3, 0.5, n.size)
    host.sums[:] = np.stack([*(n * bright * s for s in (1, 3, 0.2)), n * bright, n * bright**1.5, n], 1)
    host.passes = 70
    gpu = CudaAccumulator.of(host)
    assert np.allclose(gpu.statistics(), host.statistics(), rtol=1e-4)
    for most, tolerance in ((100, 0.0), (9, 0.05), (64, 0.08)):
        pixels, count = gpu.wanted(most, tolerance)
        found = pixels.copy_to_host()
        wanted, _ = host.wanted(most, tolerance)
        assert 0 < count < n.size
        assert count == (found >= 0).sum()
        assert (found[found >= 0] == wanted).all()
    for film, mode in (
        *((Film(tone=tone, exposure=0.7), "light") for tone in ("filmic", "reinhard", "none")),
        (Film(bloom=0.5), "light"),
        (Film(), "normal"),
    ):
        assert abs(gpu.shown(film, mode).astype(int) - host.shown(film, mode)).max() <= 1
    host.passes = gpu.passes = 1
    assert abs(gpu.shown(Film(), "light").astype(int) - host.shown(Film(), "light")).max() <= 1
    again, fresh = gpu.anew(2), host.anew(2)
    assert not again.host().sums.any() and gpu.passes != again.passes == 0
    for number in (0, 1):
        again.passes = fresh.passes = number
        assert (again.wanted(9, 0.1)[0].copy_to_host() == fresh.wanted(9, 0.1)[0]).all()


if __name__ == "__main__":
    with np.errstate(all="ignore"):
        kernels()
        accumulators()
