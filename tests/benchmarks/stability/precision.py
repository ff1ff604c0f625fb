"""Float32 and float64 kernels against the float64 reference, over decades of scale, depth and parameters.

`python -m tests.benchmarks.stability.precision [--write]`: a table of every formula, at most a few minutes.
"""

from __future__ import annotations

from collections.abc import Iterator

from tests.benchmarks.tables import publish, table
from tests.examples import EXAMPLES
from tests.stability.measure import coordinate_error, depth_error, nan_count, scale_error

PRECISIONS = ("float32", "float64")


def rows() -> Iterator[list[str]]:
    for name, root in EXAMPLES.items():
        row = [name]
        for measure in (scale_error, coordinate_error):
            row += [f"{measure(root, precision):.0e}" for precision in PRECISIONS]  # type: ignore[arg-type]
        deep = "iterations" in root.values
        row += [f"{depth_error(root, precision):.0e}" if deep else "" for precision in PRECISIONS]  # type: ignore[arg-type]
        lost, seen = (sum(n) for n in zip(*(nan_count(root, p) for p in PRECISIONS), strict=True))  # type: ignore[arg-type]
        yield [*row, f"{lost} of {seen}"]


def main() -> None:
    head = ["", "scale, float32", "float64", "far and near, float32", "float64", "depth, float32", "float64"]
    publish("precision", table([*head, "not a number"], rows()))


if __name__ == "__main__":
    main()
