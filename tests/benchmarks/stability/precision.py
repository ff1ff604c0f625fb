"""Float32 and float64 kernels against the float64 reference, over decades of scale, depth and parameters."""

from __future__ import annotations

from collections.abc import Iterator

from tests.examples import EXAMPLES
from tests.stability.measure import coordinate_error, depth_error, nan_count, scale_error

from ..runner import Row, Run

PRECISIONS = ("float32", "float64")


SMALLEST = {"names": ("sphere",)}


def rows(run: Run, names: tuple[str, ...] = tuple(EXAMPLES)) -> Iterator[Row]:
    for name in names:
        root, row = EXAMPLES[name], {"": name}
        measures = {"scale": scale_error, "far and near": coordinate_error}
        if "iterations" in root.values:
            measures["depth"] = depth_error
        for title, measured in measures.items():
            for precision in PRECISIONS:
                row[f"{title}, {precision}"] = f"{measured(root, precision):.0e}"  # type: ignore[arg-type]
        lost, seen = (sum(n) for n in zip(*(nan_count(root, p) for p in PRECISIONS), strict=True))  # type: ignore[arg-type]
        yield {**row, "not a number": f"{lost} of {seen}"}
