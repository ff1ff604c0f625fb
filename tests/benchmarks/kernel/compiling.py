"""What deep scenes and those of many elements cost to compile, against a small one: CPU time, one process.

`python -m tests.benchmarks.kernel.compiling`: medians of five, float32, the kernel of samples alone.
"""

from __future__ import annotations

import time

from fracslice.formulas import Node, bounds, box, sphere, transform, union
from fracslice.kernel import compiler, link
from fracslice.kernel.host import REGISTERS, host, lane_count
from fracslice.kernel.loops import bricks, points


def nested(depth: int) -> Node:
    root = sphere()
    for k in range(depth - 1):
        root = bounds(root, min=(-9 - k, -9, -9), max=(9, 9, 9))
    return root


def balls(count: int) -> Node:
    return union(*(transform(sphere(radius=1 + k), translate=(k + 1, 0, 0)) for k in range(count)))


def mixed(count: int, **values: float) -> Node:
    return union(*(kind() for k in range(count) for kind in (sphere, box)), **values)


SCENES = {
    "a sphere": sphere(),
    "10 elements inside each other": nested(10),
    "20": nested(20),
    "40": nested(40),
    "a union of 2 spheres": balls(2),
    "80": balls(80),
    "a union of 2 spheres and boxes": mixed(1),
    "of 80": mixed(40),
    "a smooth one of 80": mixed(40, smooth=0.1),
}


def cost(root: Node) -> float:
    """Seconds of CPU time to link and compile."""
    took = []
    for _ in range(5):
        start = time.process_time()
        target = compiler.Target(32, lane_count(32), REGISTERS, *host())
        compiler.compile_object(link(root), target, (points, bricks))
        took.append(time.process_time() - start)
    return sorted(took)[2]


def main() -> None:
    cost(SCENES["a sphere"])
    base = cost(SCENES["a sphere"])
    for name, root in SCENES.items():
        print(f"{name:34}{cost(root) / base:6.1f} times a sphere")


if __name__ == "__main__":
    main()
