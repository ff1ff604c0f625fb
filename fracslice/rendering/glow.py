"""Bodies that glow, as lights of a render kernel; see `units.glowing`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ..fields.linker import Linker
from ..fields.registry import Fixed, Node
from ..formulas.material import material, stops
from .setup import Optics
from .units import glowing
from .units.glossy import highlight
from .units.pixel import linear


@dataclass
class Drawn:
    """Random numbers of a bounce."""

    count: int = 0  # numbers in use

    def names(self, count: int) -> list[str]:
        """Reserve random numbers."""
        self.count += count
        return [f"u[{k}]" for k in range(self.count - count, self.count)]


MOST = 16
"""Bodies of their own; more than that are one."""
THINNEST = 1e-3
"""Least side of a box, relative to its largest."""
CHANNELS, AXES = "rgb", "xyz"


def glowing_bodies(root: Node) -> list[tuple[float, ...]]:
    """Return the bodies that glow."""
    nodes = {id(n): n for n in root.walk() if n.formula.name == material.name and n["glow"]}
    bodies = [_body(_only(root, node), node) for node in nodes.values()]
    known = [body for body in bodies if body]
    if len(known) <= MOST:
        return known
    low, high = (
        [kind(b[a] + s * b[a + 3] for b in known) for a in range(3)] for kind, s in ((min, -1), (max, 1))
    )
    return [_numbers(low, high, sum(b[-1] for b in known))]


def _only(node: Node, wanted: Node) -> Node | None:
    """The tree without the members of its unions that do not hold a node; None if nothing holds it."""
    if node is wanted:
        return node
    parts = [part for child in node.children if (part := _only(child, wanted))]
    if node.formula.name == "union" or not parts:
        return node.changed(tuple(parts)) if len(parts) > 1 else next(iter(parts), None)
    return node.changed((parts[0],)) if len(node.children) == 1 else node


def _body(part: Node | None, node: Node) -> tuple[float, ...]:
    """Numbers of the body of a material; empty if it has no end."""
    assert part
    box = part.bounds.box
    if not box.finite or min(box.size) <= 0:
        return ()
    x, y, z = box.size
    return _numbers(box.lo, box.hi, node["glow"] * max(linear(stops(node))) * (x * y + y * z + z * x))


def _numbers(low: Sequence[float], high: Sequence[float], power: float) -> tuple[float, ...]:
    """Centre and half sides of a box, and a power."""
    half = [(b - a) / 2 for a, b in zip(low, high, strict=True)]
    least = THINNEST * max(half)
    return (*((a + b) / 2 for a, b in zip(low, high, strict=True)), *(max(h, least) for h in half), power)


def wholly_met(bodies: list[tuple[float, ...]], eye: Sequence[float], seen: Optics) -> float:
    """Part of a pixel's width that is no wider than any body, at most 1: rays pass what is narrower."""
    parts = [max(b[3:6]) / (seen.cone * math.dist(eye, b[:3]) + seen.least) for b in bodies]
    return min([1.0, *parts])


def bind(linker: Linker, bodies: list[tuple[float, ...]]) -> list[str]:
    """Bind the units; return the lines for the start v of rays that continue and the share sent to
    bodies.
    """
    values = {"bodies": tuple(bodies), "count": Fixed(len(bodies))}
    for function in (glowing.sent_share, glowing.towards_body, glowing.body_density):
        linker.bind(f"{function.__name__}_", function, values)
    linker.share(glowing.mixed_density)
    start = [f"v{a} = {a} + 0.1 * h * n{a}" for a in AXES]  # above bodies that end at the surface
    return [*start, "sent = sent_share_(vx, vy, vz, nx, ny, nz, P)"]


def density(name: str, to: str) -> str:
    """Return the line for the density of rays that continue in a direction.

    `to`: first letter of the direction's components.
    """
    ray = ", ".join(f"{to}{a}" for a in AXES)
    beside = f"body_density_(vx, vy, vz, nx, ny, nz, {ray}, P)"
    return f"{name} = mixed_density(sent, {beside}, nx, ny, nz, dx, dy, dz, {ray}, roughness, share)"


def scatter_lines(linker: Linker, drawn: Drawn, u: str, v: str, choice: str, facets: str) -> list[str]:
    """Return the lines that choose between a reflected ray, a scattered one and one to a body.

    `facets`: reflectance of microfacets; the colour is left open.
    """
    linker.share(highlight)
    (w,) = drawn.names(1)
    lines = [
        f"away = {choice} < sent",
        f"chosen = ({choice} - sent) / (1.0 - sent) < share",
        f"picked = {choice} / maximum(sent, 1e-6)",
        f"px, py, pz = towards_body_(vx, vy, vz, nx, ny, nz, {u}, {v}, {w}, picked, P)",
        *(f"e{a} = where(away, p{a}, where(chosen, e{a}, w{a}))" for a in AXES),
        "sharp = where(away, 0.0, where(chosen & (roughness <= 0.0), 1.0, 0.0))",
        density("eq", "e"),
        "spot, half = highlight(nx, ny, nz, dx, dy, dz, ex, ey, ez, roughness)",
        "cosine = maximum(nx * ex + ny * ey + nz * ez, 0.0)",
    ]
    for c in CHANNELS:
        lines += [
            f"shine = where(roughness > 0.0, spot * {facets.format(c)}, 0.0)",
            f"t{c} = where(sharp > 0.5, t{c} / maximum(share * (1.0 - sent), 1e-6), "
            f"(c{c} * cosine + shine) / ({math.pi} * maximum(eq, 1e-9)))",
        ]
    return [
        *lines,
        "eq = where(sharp > 0.5, 0.0, eq)",
        "alive = where(away, 1.0, minimum(mirrors + scatters, 1.0))",
    ]
