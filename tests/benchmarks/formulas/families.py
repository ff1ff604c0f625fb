"""Every formula: source, what is known of it, error of the kernels, and its mesh, checked.

The error is that of random points against NumPy in float64, relative to 1 + |f|. A mesh that is not
watertight, or has self-intersections or other defects, is a fault; so is a formula of which nothing is known.
`--picture yes` renders the contact sheet of docs/reference/elements.md.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

import numpy as np

from fracslice import make_mesh
from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.formulas import Formula, Node
from fracslice.scene.layout import formulas
from tests.examples import EXAMPLES
from tests.formulas.truths import TRUTHS

from ..runner import Row, Run
from . import pictures

SMALLEST = {"resolution": 16, "names": ("sphere",)}
SOURCE = re.compile(r"(?:von )?[A-Z]\w+(?:(?:,| and) [A-Z]\w+)*,? (?:1[89]|20)\d\d")


def source(formula: Formula) -> str:
    """Author and year that the docstring cites first."""
    cited = SOURCE.search(" ".join(formula.doc.split()))
    return cited.group() if cited else ""


def smallest(formula: Formula) -> Node:
    """The example of fewest elements that has one of the formula."""
    counts = {name: Counter(node.formula for node in root.walk()) for name, root in EXAMPLES.items()}
    return EXAMPLES[min((n for n in counts if formula in counts[n]), key=lambda n: counts[n].total())]


def error(root: Node, precision: str) -> float:
    points = np.random.default_rng(3).uniform(-1.6, 1.6, (3, 4000)).astype(precision).astype(float)
    known = reference(root)(*points)
    return float((abs(compile_scene(root, precision).points(*points) - known) / (1 + abs(known))).max())  # type: ignore[arg-type]


def rows(
    run: Run, resolution: int = 96, names: tuple[str, ...] = ("",), picture: str = "no"
) -> Iterator[Row]:
    if picture == "yes":
        pictures.write(pictures.SHEET)
    for formula in formulas():
        if names != ("",) and formula.name not in names:
            continue
        root = smallest(formula)
        known = Counter(truth.kind for truth in TRUTHS[formula.name])
        row = {
            "": formula.name,
            "source": source(formula),
            "known": ", ".join(f"{count} {kind}" for kind, count in known.items()),
            "float32": f"{error(root, 'float32'):.0e}",
            "float64": f"{error(root, 'float64'):.0e}",
        }
        if not known:
            run.faults.append(f"{formula.name}: nothing is known of it")
        yield row | (audited(run, formula.name, root, resolution) if root.bounds.box.finite else {})


def audited(run: Run, name: str, root: Node, resolution: int) -> Row:
    mesh = make_mesh(root, resolution=resolution)
    report = mesh.report.mesh
    if not (mesh.is_watertight and report.printable):
        run.faults.append(f"{name}: {'; '.join(report.problems)}")
    return {
        "triangles": len(mesh.triangles),
        "bodies": report.components,
        "self-intersections": report.self_intersections,
        "mesh": "closed" if mesh.is_watertight else "open",
    }
