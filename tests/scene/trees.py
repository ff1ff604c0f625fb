"""Random scene trees, made from the registry: every formula with every kind of parameter."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st

from fracslice.common.parameters import (
    AUTO,
    REQUIRED,
    SMALLEST,
    Axis,
    Choice,
    Count,
    Digest,
    File,
    Label,
    Number,
    Points,
    Vector,
)
from fracslice.errors import SceneError
from fracslice.fields.varying import Variable
from fracslice.formulas import Node
from fracslice.scene import scene
from fracslice.scene.layout import formulas
from fracslice.scene.model import computing
from tests.examples import BRACKET, GRID, HILLS, TRUSS

SHAPES = [f for f in formulas() if f.children[1] == 0]
OTHERS = [f for f in formulas() if f.children[1] != 0]


def value(kind: Any) -> st.SearchStrategy[Any]:
    """Possible values of a parameter, and None for its default."""
    left_out = st.nothing() if kind.default is REQUIRED else st.none()
    return left_out | _POSSIBLE[type(kind)](kind)


def _number(kind: Number | Vector) -> st.SearchStrategy[float]:
    low, high = max(kind.above, kind.least, -1e6), min(kind.below, kind.most, 1e6)
    low = SMALLEST if low == 0 == kind.above else low
    return st.floats(low, high, exclude_min=low == kind.above, exclude_max=high == kind.below)


def _count(kind: Count) -> st.SearchStrategy[Any]:
    numbers = st.integers(kind.least, kind.most)
    return numbers | st.just(AUTO) if kind.words else numbers


def _vector(kind: Vector) -> st.SearchStrategy[tuple[float, ...]]:
    items = st.integers(int(kind.least), int(min(kind.most, 9))) if kind.whole else _number(kind)
    return (
        st.sampled_from(kind.sizes)
        .flatmap(lambda n: st.tuples(*[items] * n))
        .filter(lambda v: any(v) or not kind.nonzero)
    )


_POSSIBLE: dict[type, Any] = {
    Number: _number,
    Variable: lambda kind: _number(kind) | st.sampled_from(("0.1 + 0.2*z", "min(x*x, 0.5)")),
    Count: _count,
    Vector: _vector,
    Choice: lambda kind: st.sampled_from(kind.choices),
    File: lambda kind: st.sampled_from((BRACKET, GRID, HILLS, TRUSS)) if kind.inside else st.none(),
    Digest: lambda kind: st.none(),
    Label: lambda kind: st.sampled_from(("LUMEN", "surface", "<&lt;", "e\u0301")),
    Points: lambda kind: st.just(((0.0, 0.0, 0.0), (1.0, 0.5, 0.0))),
    Axis: lambda kind: st.sampled_from("xyz"),
}


@st.composite
def _made(draw: Any, formula: Any, children: tuple[Node, ...]) -> Node:
    values = {name: draw(value(kind)) for name, kind in formula.parameters.items()}
    try:
        with computing(SceneError):
            node = formula(*children, **values)
        scene(node, size=1)
    except SceneError:  # values that are possible alone but not together
        return draw(st.sampled_from(SHAPES[0:1]))()
    return node


def _with_children(inner: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    def around(formula: Any) -> st.SearchStrategy[Node]:
        most = 1 if formula.children[1] == 1 else 3
        return st.lists(inner, min_size=formula.children[0], max_size=most).flatmap(
            lambda c: _made(formula, tuple(c))
        )

    return st.sampled_from(OTHERS).flatmap(around)


def trees() -> st.SearchStrategy[Node]:
    leaves = st.sampled_from(SHAPES).flatmap(lambda f: _made(f, ()))
    return st.recursive(leaves, _with_children, max_leaves=8)
