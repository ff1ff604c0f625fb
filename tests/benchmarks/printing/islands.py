"""Random scenes and shipped ones with supports: islands, overhangs and necks that are left, of 500 random
trees.

A scene with an island, or with an overhang beyond the limit of `fracslice check`, is a fault, unless it is in
a hole without exit.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from fracslice.checks.layer_checks import check_layers
from fracslice.errors import FracsliceError
from fracslice.fields.field import Field
from fracslice.records import Print
from fracslice.scene import library, read
from fracslice.slicing import SliceJob, plan_stack
from fracslice.work import Work
from tests.stability.random_scenes import random_scene

from ..runner import Row, Run

SMALLEST = {"count": 1, "shipped": 0, "size": 10.0, "layer": 0.2}
RUNS = 1
DEAR = 60.0
"""CPU seconds from which on an object is listed, too."""


def rows(
    run: Run, count: int = 500, first: int = 0, shipped: int = 20, size: float = 30.0, layer: float = 0.1
) -> Iterator[Row]:
    names = library.names()[:shipped]
    objects: list[tuple[str, Field]] = [(name, read(library.path(name)).root) for name in names]
    objects += [(str(tree), random_scene(tree, 0)) for tree in range(first, first + count)]
    total = dict.fromkeys(("objects", "refused", "needed", "tips", "on the object", "without"), 0)
    left = dict.fromkeys(("islands", "overhangs", "necks"), 0)
    for name, root in objects:
        made = examined(root, size, layer, Work(threads=run.threads[0]))
        total["objects"] += 1
        if isinstance(made, str):
            total["refused"] += 1
            continue
        for counts in (total, left):
            counts.update({key: counts[key] + int(made[key]) for key in counts if key in made})
        if faults := {key: made[key] for key in left if made[key]}:
            run.faults.append(f"{name}: {faults}")
        if faults or made["CPU s"] > DEAR:
            yield {"": name, **faults, "CPU s": made["CPU s"]}
    yield {"": "all", **total, **left}


def examined(root: Field, size: float, layer: float, work: Work) -> dict[str, float] | str:
    """What supports an object has, and what is left; or why it is refused."""
    job = SliceJob(size=size, layer=layer, pixel=layer, printing=Print(supports="medium"))
    start = time.process_time()
    try:
        stack = plan_stack(root, job, work)
        seconds = time.process_time() - start
        report = check_layers(stack, None, None, work)
    except FracsliceError as error:
        return str(error)
    kinds = [problem.kind for problem in report.problems]
    held = stack.supports
    counts = {"tips": held.tips, "on the object": held.inner, "without": len(held.bare)} if held else {}
    return {
        **counts,
        "needed": bool(held),
        "islands": len(report.islands),
        "overhangs": kinds.count("overhangs"),
        "necks": kinds.count("necks"),
        "CPU s": seconds,
    }
