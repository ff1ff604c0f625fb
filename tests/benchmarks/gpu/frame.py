"""A 1080p frame of the Mandelbulb on a real GPU: the renderer's kernel against nvcc on the same arithmetic.

The same units word for word, and the same loop; least of fifty times on the GPU.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from fracslice.expr import cuda_driver
from fracslice.formulas import mandelbulb
from fracslice.rendering.accumulator import CHANNELS, COUNT, COVER, GOAL, PassPlan, SampleRange, tile_order
from fracslice.rendering.cuda import CudaTracer
from fracslice.rendering.linking import Frame, link_frame
from fracslice.rendering.packets import SHIFTS, STEPS, CpuTracer
from fracslice.rendering.setup import optics
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.work import Work

from ..runner import Row, Run
from . import native
from .sampling import best

WIDTH, HEIGHT = 1920, 1080
ROUNDS, TIMES = 256, 50
"""More samples than a pixel gets here, and timed frames."""
SINGLE = np.dtype(np.float32)


def frame(width: int, height: int) -> Frame:
    """A Mandelbulb under one light without a shadow."""
    root, camera = mandelbulb(iterations=8), Camera(eye=(0.0, -2.6, 0.0), fov=37.0)
    light = Light(kind="sun", position=(1.0, -1.2, 1.2), shadows="no")
    view = View(camera=camera, lights=(light,), shading=Shading(ambient=0.15))
    return link_frame(root, view, camera, optics(camera, (width, height), root, 1e-5))


FRAME = r"""
#include <cstdio>
#include <cstdlib>
#include <vector>
typedef unsigned int u32;
__device__ u32 hashed(u32 a) {
    a = (a ^ (a >> 16)) * 0x7FEB352Du;
    a = (a ^ (a >> 15)) * 0x846CA68Bu;
    return a ^ (a >> 16);
}
__device__ u32 scrambled(u32 a, u32 seed) {
    a ^= a * 0x3D20ADEAu;
    a += seed;
    a *= (seed >> 16) | 1;
    a ^= a * 0x05526C56u;
    a ^= a * 0x53A22864u;
    return __brev(a);
}
__device__ float centred(u32 a, u32 pixel, u32 dimension) {
    u32 seed = hashed(pixel * 64 + (pixel >> 26) * 0x9E3779B9u + dimension);
    return ((scrambled(a, seed) ^ scrambled(0, seed) ^ 0x80000000u) >> 8) * 5.9604644775390625e-08f;
}
__device__ float tamed(float c) { return c == c ? fminf(fmaxf(c, 0.0f), 1e4f) : 0.0f; }
__global__ void tile(Parameters P, const int *Q, const float *S, const int *pixels, int count, float *A,
                     int width, float limit, int blocks) {
    int k = blockIdx.x * blockDim.x + threadIdx.x;
    int pixel = pixels[k < count ? k : count - 1], column = pixel & 65535, row = pixel >> 16;
    float *a = A + CHANNELS * (row * width + column);
    if (k >= count || !(a[COUNT] < a[GOAL])) return;
    const int *q = Q + 2 * int(a[COUNT]);
    auto ray = camera_ray_(column + centred(q[0], pixel, 0), row + centred(q[1], pixel, 1), 0.0f, 0.0f, P);
    float ox = ray[0], oy = ray[1], oz = ray[2], dx = ray[3], dy = ray[4], dz = ray[5];
    auto span = span_box_(ox, oy, oz, dx, dy, dz, P);
    float start = fmaxf(span[0], S[(row >> SHIFT) * blocks + (column >> SHIFT)]), end = span[1];
    float t = start, steps = 0, before = 0, stride = 0;
    bool missed = start >= end;
    while (!missed) {
        auto step = step_ray_(ox, oy, oz, dx, dy, dz, t, before, stride, 1.0f, 0.0f, P);
        t = step[0], before = step[1], stride = step[2];
        steps += 1.0f;
        if (step[3] < 0.0f) break;
        missed = (stride > 0.0f ? t - stride + before : t) > end;
        if (steps >= limit) break;
    }
    __syncwarp();
    float r, g, b;
    if (missed) {
        auto colour = background_(dx, dy, dz, 0.0f, P);
        r = colour[0], g = colour[1], b = colour[2];
    } else {
        auto light = surface_(ox + t * dx, oy + t * dy, oz + t * dz, dx, dy, dz, t, 0.0f, steps, 1.0f, 1.0f,
                              0.0f, Tuple<1>{{0.0f}}, P).first;
        r = light[0], g = light[1], b = light[2];
    }
    r = tamed(r), g = tamed(g), b = tamed(b);
    float bright = 0.2126f * r + 0.7152f * g + 0.0722f * b;
    bright = bright / (1.0f + bright);
    a[0] += r, a[1] += g, a[2] += b, a[3] += bright, a[4] += bright * bright, a[COUNT] += 1.0f;
    a[COVER] += missed ? 0.0f : 1.0f;
}
int main(int, char **argument) {
    int width = atoi(argument[2]), height = atoi(argument[3]), count = width * height;
    int blocks = (width + (1 << SHIFT) - 1) >> SHIFT, rows = (height + (1 << SHIFT) - 1) >> SHIFT;
    int *placed, *points;
    std::vector<int> pixels(count), drawn(2 * ROUNDS);
    FILE *file = fopen(argument[1], "rb");
    if (fread(pixels.data(), 4, count, file) != size_t(count)) return 1;
    if (fread(drawn.data(), 4, 2 * ROUNDS, file) != 2 * ROUNDS) return 1;
    std::vector<float> sums(size_t(CHANNELS) * count);
    for (int i = 0; i < count; i++) sums[size_t(CHANNELS) * i + GOAL] = ROUNDS;
    float *A, *S, best = 1e30f;
    double mean = 0;
    cudaMalloc(&A, sums.size() * 4);
    cudaMalloc(&S, blocks * rows * 4);
    cudaMalloc(&placed, count * 4);
    cudaMalloc(&points, drawn.size() * 4);
    cudaMemset(S, 0, blocks * rows * 4);
    cudaMemcpy(placed, pixels.data(), count * 4, cudaMemcpyHostToDevice);
    cudaMemcpy(points, drawn.data(), drawn.size() * 4, cudaMemcpyHostToDevice);
    cudaMemcpy(A, sums.data(), sums.size() * 4, cudaMemcpyHostToDevice);
    cudaEvent_t start, end;
    cudaEventCreate(&start);
    cudaEventCreate(&end);
    for (int round = 0; round < TIMES; round++) {
        cudaEventRecord(start);
        tile<<<(count + 127) / 128, 128>>>(GIVEN, points, S, placed, count, A, width, LIMIT, blocks);
        cudaEventRecord(end);
        cudaEventSynchronize(end);
        float time;
        cudaEventElapsedTime(&time, start, end);
        best = fminf(best, time);
        if (round == 0) {
            cudaMemcpy(sums.data(), A, sums.size() * 4, cudaMemcpyDeviceToHost);
            for (int i = 0; i < count; i++) mean += sums[size_t(CHANNELS) * i + 3];
        }
    }
    printf("%g %.9g %d\n", best, mean / count, int(cudaGetLastError()));
}
"""
"""Takes the file of the pixels and the sample sequence, width and height; prints the best time in ms, the
mean brightness of the first sample, the error code."""


def program(seen: Frame) -> str:
    """FRAME with the constants of the renderer."""
    numbers = {"CHANNELS": CHANNELS, "COUNT": COUNT, "GOAL": GOAL, "COVER": COVER, "SHIFT": SHIFTS[0]}
    numbers |= {"ROUNDS": ROUNDS, "TIMES": TIMES}
    constants = "".join(f"constexpr int {name} = {value};\n" for name, value in numbers.items())
    return f"{constants}constexpr float LIMIT = {STEPS['float32']};\n{FRAME}"


def given(seen: Frame, pixels: np.ndarray) -> np.ndarray:
    """Pixels and sample sequence, the input of the program."""
    return np.concatenate([pixels, SampleRange().points(ROUNDS, seen.samples).ravel()])


def rows(run: Run) -> Iterator[Row]:
    seen, pixels = frame(WIDTH, HEIGHT), tile_order(WIDTH, HEIGHT)
    tracer = CudaTracer(seen, SINGLE, WIDTH, HEIGHT)
    placed = cuda_driver.to_device(pixels)
    sums, work = cuda_driver.to_device(empty()), Work(1)
    tracer.add(sums, PassPlan(placed, pixels.size, 1), work)
    picture = sums.copy_to_host().reshape(-1, CHANNELS)
    tracer.add(sums, PassPlan(placed, pixels.size, ROUNDS), work)
    one = PassPlan(placed, pixels.size, 1)
    acts: dict[str, Callable[[], None]] = {
        "frame": lambda: tracer.add(sums, one, work),
        "cones": lambda: tracer.look_ahead(work),
        "frame after cones": lambda: tracer.add(sums, one, work),
    }
    for name, act in acts.items():
        sums.copy_to_device(empty())  # else a pixel reaches its goal, and its thread has nothing to do
        mean = float(picture[:, 3].mean()) if name == "frame" else None
        yield {"": f"fracslice, {name}", "ms": best(act, TIMES), "mean brightness": mean}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pixels"
        given(seen, pixels).tofile(path)
        for name, flags in native.FLAGS.items():
            took, mean, error = native.run(
                seen.linked, program(seen), flags, str(path), str(WIDTH), str(HEIGHT)
            )
            assert error == 0
            yield {"": name, "ms": took, "mean brightness": mean}
    yield {"": "CPU", "mean brightness": float(on_cpu(seen, pixels)[:, 3].mean())}


def on_cpu(seen: Frame, pixels: np.ndarray) -> np.ndarray:
    """The same sums from the lanes."""
    sums = empty()
    sums.reshape(-1, CHANNELS)[:, GOAL] = 1
    CpuTracer(seen, SINGLE, WIDTH, HEIGHT).add(sums, PassPlan(pixels, pixels.size, 1), Work())
    return sums.reshape(-1, CHANNELS)


def empty() -> np.ndarray:
    """Sums without samples, whose goals are out of reach."""
    sums = np.zeros((WIDTH * HEIGHT, CHANNELS), SINGLE)
    sums[:, GOAL] = ROUNDS
    return sums.ravel()
