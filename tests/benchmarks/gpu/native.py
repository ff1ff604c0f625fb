"""What nvcc makes of the same arithmetic: CUDA C++ programs that are built and run beside the product's
kernels."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from fracslice.fields.linker import Linked

from .cpp import translated

FLAGS: dict[str, list[str]] = {"nvcc": [], "nvcc -use_fast_math": ["-use_fast_math"]}


def run(linked: Linked, program: str, flags: list[str], *arguments: str) -> list[float]:
    """Builds a program on the scene's functions (``field_``, ``Parameters``, ``GIVEN``) and runs it; the
    numbers that it prints."""
    with tempfile.TemporaryDirectory() as folder:
        source, binary = Path(folder) / "program.cu", Path(folder) / "program"
        source.write_text(translated(linked.program, linked.parameters.tolist()) + program)
        command = ["nvcc", "-O3", "-std=c++17", "-arch=native", "-w", *flags, str(source), "-o", str(binary)]
        subprocess.run(command, check=True)
        done = subprocess.run([str(binary), *arguments], check=True, capture_output=True, text=True)
    return [float(word) for word in done.stdout.split()]


SAMPLING = r"""
#include <cstdio>
#include <vector>
__global__ void bricks(Parameters P, float ox, float oy, float oz, float h, const int *corners, float *F,
                       long long n) {
    long long i = (long long)blockIdx.x * blockDim.x + threadIdx.x, b = i >> 9;
    int s = int(i & 511);
    if (b >= n) return;
    float x = float(corners[3 * b] + (s >> 6)) * h + ox;
    float y = float(corners[3 * b + 1] + (s >> 3 & 7)) * h + oy;
    float z = float(corners[3 * b + 2] + (s & 7)) * h + oz;
    F[i] = field_(x, y, z, P);
}
int main(int, char **argument) {
    std::vector<int> corners;
    FILE *file = fopen(argument[1], "rb");
    for (int value; fread(&value, 4, 1, file);) corners.push_back(value);
    float o[4];
    for (int i = 0; i < 4; i++) sscanf(argument[2 + i], "%f", o + i);
    long long n = corners.size() / 3, count = n * 512;
    int *placed;
    float *F;
    cudaMalloc(&placed, corners.size() * 4);
    cudaMalloc(&F, count * 4);
    cudaMemcpy(placed, corners.data(), corners.size() * 4, cudaMemcpyHostToDevice);
    cudaEvent_t start, end;
    cudaEventCreate(&start);
    cudaEventCreate(&end);
    float best = 1e30f;
    for (int round = 0; round < 10; round++) {
        cudaEventRecord(start);
        bricks<<<(count + 127) / 128, 128>>>(GIVEN, o[0], o[1], o[2], o[3], placed, F, n);
        cudaEventRecord(end);
        cudaEventSynchronize(end);
        float time;
        cudaEventElapsedTime(&time, start, end);
        best = fminf(best, time);
    }
    std::vector<float> values(count);
    cudaMemcpy(values.data(), F, count * 4, cudaMemcpyDeviceToHost);
    long long inside = 0;
    for (float value : values) inside += value < 0;
    printf("%g %lld %d\n", best, inside, int(cudaGetLastError()));
}
"""
"""Takes the file of the corners, the origin and the voxel; prints the best time of ten in ms, how many
samples are inside, and CUDA's error code."""
