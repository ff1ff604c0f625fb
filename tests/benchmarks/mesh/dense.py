"""The mesh against what one would write in an afternoon: a dense grid by parallel scalar Numba, and
scikit-image.

`python -m tests.benchmarks.mesh.dense [N]`: N voxels (256) along the side of the scene's own box, warm, in
one process.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from numba import njit, prange
from skimage.measure import marching_cubes

from fracslice.formulas import Box, Node
from fracslice.kernel import compile_scene, link
from fracslice.mesh.extract import contour, extract
from fracslice.volume import Lattice, sample

from .kernel import SCENES, scalar_kernel


def dense(root: Node, half: float, n: int) -> Callable[[], object]:
    row, parameters = scalar_kernel(root), link(root).parameters.astype(np.float32)
    axis = np.linspace(-half, half, n, dtype=np.float32)

    @njit(parallel=True)  # type: ignore[misc]
    def fill(out: np.ndarray) -> None:
        for i in prange(n):
            x = np.full(n, axis[i])
            for j in range(n):
                row(parameters, x, np.full(n, axis[j]), axis, out[i, j])

    def run() -> object:
        out = np.empty((n, n, n), np.float32)
        fill(out)
        return marching_cubes(out, 0.0, spacing=(2 * half / (n - 1),) * 3)

    return run


def seconds(run: Callable[[], object]) -> float:
    run()
    times = []
    for _ in range(3):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return sorted(times)[1]


def main() -> None:
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 256
    print(
        f"{'field and triangles, seconds':30}{'sparse':>9}{'exact':>9}{'dense':>9}"
        f"{'dense / sparse':>16}{'/ exact':>9}"
    )
    for name, root in SCENES.items():
        half = 1.05 * max(root.bounds.box.hi)
        kernel, lattice = compile_scene(root), Lattice.around(Box.centred(half), 2 * half / (n - 1))
        plain = seconds(lambda k=kernel, r=root, la=lattice: extract(sample(k, r.bounds, la)))
        exact = seconds(lambda k=kernel, r=root, la=lattice: contour(r, sample(k, r.bounds, la)))
        slow = seconds(dense(root, half, n))
        print(
            f"{name + f' at {n}^3':30}{plain:9.3f}{exact:9.3f}{slow:9.3f}"
            f"{slow / plain:15.1f}x{slow / exact:8.1f}x"
        )


if __name__ == "__main__":
    main()
