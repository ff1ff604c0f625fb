"""The CUDA renderer where there is no GPU: its code, and its threads on the CPU against the lanes.

On a real one: ``python -m tests.benchmarks gpu.frame``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from fracslice.expr import cuda_driver
from fracslice.expr.emitter import compile_ptx
from fracslice.expr.graph import NOTHING
from fracslice.rendering.accumulator import CHANNELS, HostAccumulator, PassPlan, tile_order
from fracslice.rendering.cuda import LOOPS, CudaAccumulator, CudaTracer
from fracslice.rendering.packets import CpuTracer, loops
from fracslice.scene.view import Film, Light, Shading, View
from fracslice.work import Work
from tests.examples import stamped
from tests.kernel.cuda_host import H200, HostDriver, runs_on_cpu
from tests.rendering.cuda_cases import CASES, HEIGHT, WIDTH, frame

pytestmark = pytest.mark.once

REPRESENTATIVES = "glass and mirrors", "surroundings, a sun that rays meet"
"""Cases of every run; the others are of a night."""
SAMPLE = 65
SINGLE = np.dtype(np.float32)


@pytest.mark.parametrize("name", stamped(CASES, REPRESENTATIVES))
def test_float32_kernels_hold_no_float64_and_keep_rays_in_registers(name: str) -> None:
    seen = frame(name)
    ptx = compile_ptx(seen.linked.program, 32, H200, loops(seen)).decode()
    assert ".f32" in ptx
    assert ".f64" not in ptx
    assert ".local" not in ptx


def test_what_keeps_the_picture_holds_no_float64() -> None:
    ptx = compile_ptx(NOTHING, 32, H200, LOOPS).decode()
    assert ".f32" in ptx
    assert ".f64" not in ptx


def test_threads_go_on_together_after_the_march() -> None:
    """Without the barrier those that hit first shade alone, and a frame takes twice as long."""
    seen = frame("fractal")
    ptx = compile_ptx(seen.linked.program, 32, H200, loops(seen)).decode()
    assert len(re.findall(r"bar\.warp\.sync", ptx.split(".entry tile(")[1].split(".entry")[0])) == 1


@pytest.fixture(autouse=True)
def threads(monkeypatch: pytest.MonkeyPatch) -> Iterator[HostDriver]:
    yield from runs_on_cpu(monkeypatch)


@pytest.mark.parametrize("name", stamped(CASES, REPRESENTATIVES))
def test_pictures_are_those_of_the_lanes(name: str) -> None:
    pictures = [HostAccumulator.empty(WIDTH, HEIGHT, SINGLE) for _ in range(2)]
    for picture in pictures:
        picture.channels[..., 5:7] = SAMPLE, SAMPLE + 1
    cpu, gpu = (kind(frame(name), SINGLE, WIDTH, HEIGHT) for kind in (CpuTracer, CudaTracer))
    cpu.look_ahead(Work(1)), gpu.look_ahead(Work(1))
    plan = PassPlan(tile_order(WIDTH, HEIGHT), WIDTH * HEIGHT, SAMPLE + 1)
    cpu.add(pictures[0].sums, plan, Work(1))
    placed, pixels = (cuda_driver.to_device(a) for a in (pictures[1].sums, plan.pixels))
    gpu.add(placed, replace(plan, pixels=pixels, last=SAMPLE + 1), Work(1))
    placed.copy_to_host(pictures[1].sums)
    sums = [picture.sums.reshape(-1, CHANNELS) for picture in pictures]
    alike = np.isclose(*sums, rtol=1e-3, atol=1e-3).all(1).mean()  # some rays graze an edge
    assert alike > 0.97, f"{name}: {alike:.3f} of the pixels are alike"
    assert sums[0][:, 3].std() > 0.01, f"{name}: there is nothing to see"


@pytest.fixture
def host() -> HostAccumulator:
    """A picture whose pixels have 8 to 32 samples."""
    rng, picture = np.random.default_rng(3), HostAccumulator.empty(WIDTH, HEIGHT, SINGLE)
    n = 2.0 ** rng.integers(3, 6, WIDTH * HEIGHT)
    bright = rng.beta(0.3, 0.5, n.size)
    state = [*(n * bright * s for s in (1, 3, 0.2)), n * bright, n * bright**1.5, n, n, n // 2]
    picture.channels[:] = np.stack(state, 1).reshape(picture.channels.shape)
    picture.passes = 5
    return picture


class TestAccumulator:
    """It has the statistics, the choice and the tones of the one in host memory."""

    def test_of_an_empty_picture(self) -> None:
        host = HostAccumulator.empty(WIDTH, HEIGHT, SINGLE)
        gpu = CudaAccumulator(host)
        assert gpu.plan(9, 0.1).samples == host.plan(9, 0.1).samples
        np.testing.assert_array_equal(gpu.host().sums, host.sums)

    def test_in_its_choice_of_pixels(self, host: HostAccumulator) -> None:
        gpu = CudaAccumulator(host)
        assert np.allclose(gpu.statistics(), host.statistics(), rtol=1e-4)
        for most, tolerance in ((100, 0.0), (9, 0.05), (64, 0.08)):
            host.channels[..., 6] = host.channels[..., 5]
            mine, theirs = gpu.plan(most, tolerance), host.plan(most, tolerance)
            assert 0 < mine.samples < host.counts.sum()
            assert (mine.samples, mine.last) == (theirs.samples, theirs.last)
            np.testing.assert_array_equal(gpu.host().sums, host.sums)

    @pytest.mark.parametrize(
        "view",
        [
            *(View(film=Film(tone=tone, exposure=0.7)) for tone in ("filmic", "reinhard", "none")),
            View(film=Film(bloom=0.5)),
            View(film=Film(background=(1, 0.5, 0)), lights=(Light(kind="sky"),)),
            View(shading=Shading(mode="normal")),
        ],
    )
    def test_in_its_tones(self, host: HostAccumulator, view: View) -> None:
        gpu = CudaAccumulator(host)
        assert abs(gpu.shown(view).astype(int) - host.shown(view)).max() <= 1

    def test_between_passes_over_grids(self, host: HostAccumulator) -> None:
        gpu = CudaAccumulator(host)
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
