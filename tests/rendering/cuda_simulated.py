"""Run by test_cuda.py in a process of its own, on Numba's CUDA simulator, against the lanes."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from fracslice.fields.cuda import require
from fracslice.rendering.accumulator import CHANNELS, PassPlan, tile_order
from fracslice.rendering.cpu import CpuTracer
from fracslice.rendering.cuda import CudaAccumulator, CudaTracer
from fracslice.rendering.host_accumulator import HostAccumulator
from fracslice.scene.view import Film, Light, Shading, View
from fracslice.work import Work
from tests.rendering.cuda_cases import CASES, HEIGHT, WIDTH, frame

SAMPLE = 65
SINGLE = np.dtype(np.float32)


def kernels() -> None:
    for name in sys.argv[1:] or CASES:
        pictures = [HostAccumulator.empty(WIDTH, HEIGHT, SINGLE) for _ in range(2)]
        for picture in pictures:
            picture.channels[..., 5:7] = SAMPLE, SAMPLE + 1
        cpu, gpu = (kind(frame(name), SINGLE, WIDTH, HEIGHT) for kind in (CpuTracer, CudaTracer))
        cpu.look_ahead(Work(1)), gpu.look_ahead(Work(1))
        plan = PassPlan(tile_order(WIDTH, HEIGHT), WIDTH * HEIGHT, SAMPLE + 1)
        cpu.add(pictures[0].sums, plan, Work(1))
        placed, pixels = (require().to_device(a) for a in (pictures[1].sums, plan.pixels))
        gpu.add(placed, replace(plan, pixels=pixels, last=SAMPLE + 1), Work(1))
        placed.copy_to_host(pictures[1].sums)
        sums = [picture.sums.reshape(-1, CHANNELS) for picture in pictures]
        # A ray that grazes an edge may fall on either side of it.
        alike = np.isclose(*sums, rtol=1e-3, atol=1e-3).all(1).mean()
        assert alike > 0.97, f"{name}: {alike:.3f} of the pixels are alike"
        assert sums[0][:, 3].std() > 0.01, f"{name}: there is nothing to see"


def accumulators() -> None:
    """Statistics, choice and tones of the same sums."""
    rng = np.random.default_rng(3)
    host = HostAccumulator.empty(WIDTH, HEIGHT, SINGLE)
    gpu = CudaAccumulator(host)
    assert gpu.plan(9, 0.1).samples == host.plan(9, 0.1).samples
    np.testing.assert_array_equal(gpu.host().sums, host.sums)
    n = 2.0 ** rng.integers(3, 6, WIDTH * HEIGHT)
    bright = rng.beta(0.3, 0.5, n.size)
    state = [*(n * bright * s for s in (1, 3, 0.2)), n * bright, n * bright**1.5, n, n, n // 2]
    host.channels[:] = np.stack(state, 1).reshape(host.channels.shape)
    host.passes = 5
    gpu = CudaAccumulator(host)
    assert np.allclose(gpu.statistics(), host.statistics(), rtol=1e-4)
    for most, tolerance in ((100, 0.0), (9, 0.05), (64, 0.08)):
        host.channels[..., 6] = host.channels[..., 5]
        mine, theirs = gpu.plan(most, tolerance), host.plan(most, tolerance)
        assert 0 < mine.samples < n.sum()
        assert (mine.samples, mine.last) == (theirs.samples, theirs.last)
        np.testing.assert_array_equal(gpu.host().sums, host.sums)
    for view in (
        *(View(film=Film(tone=tone, exposure=0.7)) for tone in ("filmic", "reinhard", "none")),
        View(film=Film(bloom=0.5)),
        View(film=Film(background=(1, 0.5, 0)), lights=(Light(kind="sky"),)),
        View(shading=Shading(mode="normal")),
    ):
        assert abs(gpu.shown(view).astype(int) - host.shown(view)).max() <= 1
    host.passes = gpu.passes = 1
    host.channels[..., 6] = 0
    assert abs(gpu.shown(View()).astype(int) - host.shown(View())).max() <= 1
    again, fresh = gpu.anew(), host.anew()
    assert not again.host().sums.any() and gpu.passes != again.passes == 0
    for number in (0, 1):
        again.passes = fresh.passes = number
        assert again.plan(9, 0.1).samples == fresh.plan(9, 0.1).samples > 0
        np.testing.assert_array_equal(again.host().sums, fresh.sums)
        fresh.channels[..., 5] = fresh.channels[..., 6]
        again = CudaAccumulator(fresh)


if __name__ == "__main__":
    with np.errstate(all="ignore"):
        kernels()
        accumulators()
