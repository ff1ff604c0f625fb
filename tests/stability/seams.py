"""Seams, cuts, walls and folds of fractals: high powers, powers that are not whole, and two at once."""

from __future__ import annotations

from fracslice.formulas import (
    Node,
    box,
    difference,
    intersection,
    julia,
    mandelbulb,
    mirror,
    offset,
    repeat,
    shell,
    sphere,
    transform,
    union,
)

HIGH = mandelbulb(iterations=5, power=24)
TORN = mandelbulb(iterations=4, power=7.5)
ASIDE = transform(TORN, translate=(0.4, 0.1, -0.2), scale=0.7)

SEAMS: dict[str, Node] = {
    "seam, power 8": union(mandelbulb(iterations=6), sphere(radius=1.02), smooth=0.1),
    "seam, power 24": union(HIGH, sphere(radius=1.02), smooth=0.1),
    "seam, power 7.5": union(TORN, sphere(radius=1.1), smooth=0.1),
    "seam of two fractals": union(HIGH, transform(julia(iterations=8), scale=0.8), smooth=0.1),
    "seam of two torn ones": union(TORN, ASIDE, smooth=0.1),
    "seam of folds": union(
        mirror(ASIDE, axis="x"), repeat(ASIDE, period=(1.6, 2, 2), count=(2, 1, 1)), smooth=0.05
    ),
    "smooth intersection, power 7.5": intersection(TORN, box(size=(1.5, 1.2, 3)), smooth=0.1),
    "smooth difference, power 24": difference(sphere(radius=1.2), HIGH, smooth=0.08),
    "grown, power 24": offset(HIGH, distance=0.02),
    "wall, power 7.5": shell(offset(TORN, distance=0.1), thickness=0.05),
}
