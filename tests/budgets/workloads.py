"""The fixed workloads whose cost is counted."""

from __future__ import annotations

from fracslice.formulas import Node, julia, mandelbulb, menger, sphere

WORKLOADS: dict[str, Node] = {
    "mandelbulb": mandelbulb(iterations=10),
    "julia": julia(iterations=12),
    "menger": menger(level=4),
    "sphere": sphere(),
}
