"""Domain operators for affine maps and mirroring."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Triangles, affine, inverse, product, stretches
from ..common.parameters import REQUIRED, SMALLEST, Axis, Vector
from ..expr.vocabulary import absolute
from ..fields.box import Box
from ..fields.field import outermost
from ..fields.registry import Fixed, Node, always_keeps_sign, domain_operator


@domain_operator(
    translate=Vector((0.0, 0.0, 0.0), "moves by this, last"),
    rotate=Vector(
        None, "an axis and an angle in degrees, counter-clockwise seen against the axis", sizes=(4,)
    ),
    scale=Vector((1.0,), "one factor, or one per axis, first", sizes=(1, 3)),
    matrix=Vector(None, "3 x 4 or 4 x 4 numbers row by row, applied before the other three", sizes=(12, 16)),
)
def transform(child, x, y, z, back, shrink):  # type: ignore[no-untyped-def]
    """The element scaled, then rotated, then translated.

    The element's field is multiplied by the smallest singular value of the map. So L = the element's, and an
    exact distance stays exact where the scale is uniform.
    """
    a, b, c, d, e, f, g, h, i, tx, ty, tz = back
    return shrink * child(
        a * x + b * y + c * z + tx,
        d * x + e * y + f * z + ty,
        g * x + h * y + i * z + tz,
    )


def translate_node(child, x, y, z, offset):  # type: ignore[no-untyped-def]
    """The element translated by an offset."""
    tx, ty, tz = offset
    return child(x - tx, y - ty, z - tz)


@transform.check
def transform_check(node: Node) -> None:
    if node["rotate"] and not max(map(abs, node["rotate"][:3])) >= SMALLEST:
        raise node.fail("rotate: expected an axis that is not zero, then degrees")
    if node["matrix"] and len(node["matrix"]) == 16 and node["matrix"][12:] != (0, 0, 0, 1):
        raise node.fail("matrix: expected the last row 0 0 0 1")
    if _is_translation(node):
        return
    stretch = stretches(affine(node.values)[0])
    if not stretch[-1] > max(1e-9 * stretch[0], SMALLEST / 2):
        name = "matrix" if node["matrix"] else "scale"
        value = " ".join(f"{number:g}" for number in node[name])
        raise node.fail(f'{name}="{value}": expected a map that does not flatten space')


def _is_translation(node: Node) -> bool:
    """True for the translations that most elements are, which are computed without matrices."""
    values = node.values
    return not (values["rotate"] or values["matrix"]) and values["scale"] == (1.0,)


@transform.identity
def transform_identity(node: Node) -> bool:
    if _is_translation(node):
        return not any(node["translate"])
    linear, offset = affine(node.values)
    return _is_identity(linear) and not offset.any()


@transform.select
def transform_select(node: Node):  # type: ignore[no-untyped-def]
    stays = _is_translation(node) or _is_identity(affine(node.values)[0])
    return translate_node if stays else transform.function


def _is_identity(linear: np.ndarray) -> bool:
    return bool(linear.tolist() == [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


@transform.arguments
def transform_arguments(node: Node) -> dict[str, object]:
    if _is_translation(node):
        return {"offset": node["translate"]}
    linear, offset = affine(node.values)
    if node.function is translate_node:
        return {"offset": tuple(offset.tolist())}
    undone = inverse(linear)
    flat = [*undone.ravel().tolist(), *(-product(undone, offset)).tolist()]
    return {"back": tuple(flat), "shrink": float(stretches(linear)[-1])}


transform.keeps_sign(always_keeps_sign)


@transform.bounds
def transform_bounds(node: Node) -> Box:
    box = node.children[0].bounds.box
    if box.empty:
        return box
    if _is_translation(node):
        (a, b, c), (d, e, f), (x, y, z) = box.lo, box.hi, node["translate"]
        return Box((a + x, b + y, c + z), (d + x, e + y, f + z))
    linear, offset = affine(node.values)
    lo, hi = np.array(box.lo), np.array(box.hi)
    with np.errstate(invalid="ignore"):
        ends = np.stack([linear * lo, linear * hi])
    ends = np.where(linear == 0, 0.0, ends)
    low, high = ends.min(0).sum(1) + offset, ends.max(0).sum(1) + offset
    return Box(tuple(low.tolist()), tuple(high.tolist()))


@transform.triangles
def transform_triangles(node: Node) -> Triangles | None:
    own = node.children[0].triangles()
    if own is None:
        return None
    linear, offset = affine(node.values)
    turned = own.triangles if np.linalg.det(linear) > 0 else own.triangles[:, ::-1]
    return Triangles(product(own.vertices, linear.T) + offset, turned)


ALONG = 1e-12
"""Part of an axis across the others that is rounding: of a quarter turn, 1e-16."""


@transform.tips
def transform_tips(node: Node) -> NDArray[np.float64] | None:
    linear, offset = affine(node.values)
    along = abs(linear) > ALONG * abs(linear).max(0)
    own = node.children[0].tips if (np.count_nonzero(along, axis=0) == 1).all() else None
    return None if own is None else outermost(product(own.T, linear.T) + offset)


@domain_operator(
    axis=Axis(
        REQUIRED,
        "normal of the mirror plane: the half on its positive side is mirrored to the other side",
    )
)
def mirror(child, x, y, z, axis):  # type: ignore[no-untyped-def]
    """The half of the element on the positive side of an axis, and its mirror image.

    L = the element's: folding space does not increase distances.
    """
    return child(
        absolute(x) if axis == 0 else x, absolute(y) if axis == 1 else y, absolute(z) if axis == 2 else z
    )


def chosen_axis(node: Node) -> Fixed:
    """Index of the axis of a node, which selects code."""
    return Fixed("xyz".index(node["axis"]))


@mirror.arguments
def mirror_arguments(node: Node) -> dict[str, object]:
    return {"axis": chosen_axis(node)}


mirror.keeps_sign(always_keeps_sign)


@mirror.bounds
def mirror_bounds(node: Node) -> Box:
    axis, box = "xyz".index(node["axis"]), node.children[0].bounds.box
    lo, hi = list(box.lo), list(box.hi)
    lo[axis] = -hi[axis]
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))
