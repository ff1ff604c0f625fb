"""A scene made larger or smaller in its own parameters: lengths times a factor, curvatures divided by it."""

from __future__ import annotations

import re
from collections.abc import Callable

from fracslice.fields.varying import Varying
from fracslice.formulas import Node, transform

WALLS = (
    *("gyroid", "iwp", "lidinoid", "neovius", "schwarz_d", "schwarz_p", "frd", "fischer_koch_s", "split_p"),
    *("struts", "voronoi"),
)
LENGTHS: dict[str, tuple[str, ...]] = {
    "sphere": ("radius",),
    "box": ("size", "round"),
    "torus": ("radius", "tube"),
    "cylinder": ("radius", "height"),
    "capsule": ("from", "to", "radius"),
    "cone": ("radius", "height"),
    "plane": ("offset",),
    "octahedron": ("radius",),
    "prism": ("radius", "height"),
    "superquadric": ("size",),
    "koch": ("radius", "height"),
    "relief": ("size", "height"),
    "gear": ("radius", "height", "bore"),
    "thread": ("radius", "pitch", "height"),
    **dict.fromkeys(WALLS, ("period", "thickness")),
    "union": ("smooth",),
    "intersection": ("smooth",),
    "difference": ("smooth",),
    "shell": ("thickness",),
    "infill": ("shell", "denser", "within"),
    "onion": ("period", "thickness"),
    "thicken": ("by", "within"),
    "displace": ("by",),
    "scaffold": ("thickness", "smooth"),
    "offset": ("distance",),
    "noise": ("amplitude", "period"),
    "bounds": ("min", "max"),
    "repeat": ("period",),
    "mirror": (),
    "material": (),
    "transform": (),
    "twist": (),
    "bend": (),
}
"""The parameters of each formula that are lengths. A fractal has none: it is scaled by a transform."""


def scaled(root: Node, factor: float) -> Node:
    """The same object `factor` times as large: ``scaled(f)(factor p) = factor f(p)``."""
    if root.formula.steps or (not root.fields and root.formula.name not in LENGTHS):
        return transform(root, scale=(factor,))
    children = tuple(scaled(child, factor) for child in root.children)
    values = {name: _times(root[name], factor) for name in LENGTHS[root.formula.name]}
    return root.changed(children, **values, **_others(root, factor))


def _others(root: Node, factor: float) -> dict[str, object]:
    """What is not simply a length: angles per length, and the moving part of a transform."""
    if root.formula.name in ("twist", "bend"):
        return {"degrees": root["degrees"] / factor}
    if root.formula.name == "transform":
        result: dict[str, object] = {"translate": _times(root["translate"], factor)}
        if root["matrix"]:
            result["matrix"] = tuple(
                v * (factor if i % 4 == 3 else 1.0) for i, v in enumerate(root["matrix"])
            )
        return result
    return {}


def _times(value: object, factor: float) -> object:
    if isinstance(value, Varying):
        return Varying(re.sub(r"\b([xyz])\b", rf"(\1/{factor!r})", value.text)).times(factor)
    return tuple(v * factor for v in value) if isinstance(value, tuple) else value * factor  # type: ignore[operator]


def placed(root: Node, factor: float) -> Node:
    """The same object `factor` times as large, by a transform around all of it."""
    return transform(root, scale=(factor,))


SCALINGS: dict[str, Callable[[Node, float], Node]] = {"parameters": scaled, "transform": placed}
