"""Numbers that differ from point to point: values, slopes, bounds, and what is refused."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from fracslice import make_mesh, reads
from fracslice.common.parameters import Number
from fracslice.errors import SceneError
from fracslice.expr.frontend import formula
from fracslice.fields.box import Box
from fracslice.fields.devices import reference
from fracslice.fields.varying import Variable, Varying
from fracslice.formulas import Node, box, displace, gyroid, infill, mandelbulb, shell, sphere, struts, union
from fracslice.scene import scene, to_xml
from tests.examples import stamped

pytestmark = pytest.mark.once

RNG = np.random.default_rng(5)
POINTS = RNG.uniform(-1.2, 1.2, (3, 30_000))
BALLS = sphere(radius=0.6), sphere(radius=0.5).translate((0.7, 0, 0))

SLOPES = {
    "0.3+0.1*z": 0.1,
    "0.2*x - 0.1*y + 3": math.hypot(0.2, 0.1),
    "0.1*sin(5*x)": 0.5,
    "0.1*abs(x)": 0.1,
    "0.1*sqrt(x*x+1)": 0.1,
    "min(x*x, 4)": 4,
    "0.2*sqrt(x*x+y*y)": 0.2,
    "max(0.05, 0.3-0.1*sqrt(x**2+y**2+z**2))": 0.1,
    "exp(-(x*x+y*y))": math.sqrt(2 / math.e),
    "1/(1+x*x)": 3 * math.sqrt(3) / 8,
    "log(2+abs(z))": 0.5,
    "0.1*cos(x)*cos(y)/(2+sin(z))": 0.1,
    "0.2*sqrt((sqrt(x*x+y*y)-1)**2+z*z)": 0.2,
    "0.1*sqrt((x-1)**2 + 4*y*y + 9)": 0.2,
    "0.1*sqrt((x+y)**2/2 + (x-y)**2/2)": 0.1,
    "0.1*sqrt(x*x+y*y) + 0.1*z": 0.1 * math.sqrt(2),
    "0.1*sin(3*sqrt(x*x+y*y+z*z))": 0.3,
    "0.1*abs(sqrt(x*x+y*y) - 2)": 0.1,
}
"""Expressions, and the steepest slope that they have, or more."""
ROUGH = {"0.1*cos(x)*cos(y)/(2+sin(z))": 1.8}
"""Slopes whose bounds are farther off, as cells are longer than waves."""


@pytest.mark.parametrize(("text", "steepest"), SLOPES.items())
def test_the_slope_is_proved_and_not_far_off(text: str, steepest: float) -> None:
    found = Variable(None, "").read(text)
    assert steepest * (1 - 1e-9) <= found.slope <= ROUGH.get(text, 1.1) * steepest
    values = reference(shell(sphere(), thickness=text))
    far = 10 ** RNG.uniform(-3, 3, POINTS.shape) * np.sign(POINTS)
    number = eval(text, {name: getattr(np, name) for name in ("sin", "cos", "exp", "log", "sqrt")} | {
        "abs": np.abs, "min": np.minimum, "max": np.maximum,
        **dict(zip("xyz", (near := POINTS), strict=True)),
    })  # fmt: skip
    ball = np.linalg.norm(near, axis=0) - 1
    np.testing.assert_allclose(values(*near), np.maximum(ball, -(ball + number)), atol=1e-12)
    steps = RNG.normal(0, 1e-4, far.shape)
    at = formula(Varying(text).argument.function)
    moved, still = at(*(far + steps)), at(*far)
    assert (np.abs(moved - still) <= found.slope * np.linalg.norm(steps, axis=0) + 1e-9).all()


@pytest.mark.parametrize(
    "root",
    [
        gyroid(period=0.7, thickness="0.1+0.05*z"),
        shell(sphere(), thickness="max(0.1, 0.3*x)"),
        box().difference(*BALLS, smooth="0.3-0.2*y"),
        displace(sphere(0.8), by="0.1*sin(5*x)*cos(4*y)"),
        *stamped(
            [
                struts(period=0.7, thickness="0.2+0.1*sin(3*x)"),
                infill(sphere(), gyroid(period=0.5), shell="0.1+0.05*sqrt(x*x+y*y)"),
                union(*BALLS, smooth="0.2+0.2*z"),
                union(*BALLS, box(), smooth="0.1*abs(x)"),
                BALLS[0].intersection(BALLS[1], smooth="0.2*x"),
                displace(box().scale((0.5, 0.5, 2)), by="0.1+0.05*z"),
            ],
            [],
        ),
    ],
)
def test_fields_keep_their_bounds(root: Node) -> None:
    field = reference(root)
    steps = RNG.normal(0, 1e-3, POINTS.shape)
    values = field(*POINTS)
    change = np.abs(field(*(POINTS + steps)) - values)
    assert (change <= root.bounds.lipschitz * np.linalg.norm(steps, axis=0) * (1 + 1e-9)).all()
    assert np.abs(root.kernel().points(*POINTS) - values).max() < 1e-5
    low, high = (np.array(corner)[:, None] for corner in (root.bounds.box.lo, root.bounds.box.hi))
    assert ((low <= POINTS) & (high >= POINTS)).all(0)[values < 0].all()
    assert make_mesh(root & box(size=(1.9, 1.9, 1.9)), resolution=25).is_watertight
    assert pickle.loads(pickle.dumps(root)) == root
    assert reads(to_xml(scene(root & box(), size=20))).root == root & box()


def test_a_grade_is_an_expression() -> None:
    graded, varied = gyroid(grade=(0.1, 0, 0.2)), gyroid(thickness="0.1 + 0.1*x + 0.2*z")
    np.testing.assert_allclose(reference(graded)(*POINTS), reference(varied)(*POINTS), atol=1e-14)
    assert varied.bounds.lipschitz == pytest.approx(graded.bounds.lipschitz)


def test_a_constant_width_is_the_same_seam() -> None:
    one, other = union(*BALLS, smooth=0.2), union(*BALLS, smooth="0.2 + 0*x")
    np.testing.assert_allclose(reference(one)(*POINTS), reference(other)(*POINTS), atol=1e-12)
    assert one.bounds.box.size == pytest.approx(other.bounds.box.size)
    sharp = union(*BALLS, smooth="0*x")
    np.testing.assert_allclose(reference(sharp)(*POINTS), reference(union(*BALLS))(*POINTS), atol=1e-12)


def test_seams_that_widen_beyond_the_elements_are_in_the_box() -> None:
    root = union(box(), box().translate((1.1, 0, 0)), smooth="0.5+0.8*z")
    x, y, z = RNG.uniform((-0.5, -0.5, 0.5), (1.6, 0.5, 1.2), (200_000, 3)).T
    top = z[reference(root)(x, y, z) < 0].max()
    assert 0.5 + (0.5 + 0.8 * 0.5) / 4 < top < root.bounds.box.hi[2]


def test_functions_of_points_are_expressions() -> None:
    known = gyroid(thickness="(0.1 + (0.2 * abs(z)))")
    assert gyroid(thickness=lambda p: 0.1 + 0.2 * abs(p[2])) == known
    assert gyroid(thickness=lambda p: np.add(0.1, 0.2 * np.abs(p.z))) == known

    def ring(p):  # type: ignore[no-untyped-def]
        x, y, _ = p
        return np.maximum(0.05, 0.3 - np.sqrt(x**2 + y**2) / 10)

    assert sphere().shell(ring).bounds.lipschitz == pytest.approx(1.1)
    hypotenuse = displace(sphere(), by=lambda p: np.hypot(0.1 * p.x, p.y / 10)).bounds.lipschitz
    assert hypotenuse == pytest.approx(1.1)
    assert repr(known) == "gyroid(thickness='(0.1 + (0.2 * abs(z)))')"


def test_a_surface_is_displaced() -> None:
    moved = displace(sphere(), by=lambda p: 0.1 * p.z)
    z = POINTS[2]
    np.testing.assert_allclose(
        reference(moved)(*POINTS), np.linalg.norm(POINTS, axis=0) - 1 - 0.1 * z, atol=1e-12
    )
    assert 1.1 < moved.bounds.box.hi[2] < 1.13
    assert reference(displace(sphere(), by=0.2))(*POINTS) == pytest.approx(
        reference(sphere(1.2))(*POINTS), abs=1e-12
    )
    with pytest.raises(SceneError, match="expected one with a limit, such as min"):
        displace(sphere(), by="2*z").bounds  # noqa: B018


def test_values_in_a_box_are_enclosed() -> None:
    side = Box((-1, 0, 2), (1, 3, 4))
    assert 9 <= Varying("x*x + y*y - z + 1").most(side) <= 9.8
    assert Varying("min(x, 5)").most(Box.everywhere()) == pytest.approx(5)


@pytest.mark.parametrize(
    ("value", "error"),
    [
        ("x*x", "its slope has no bound, as that of min(..., 1) may have"),
        ("floor(z)", "its slope has no bound"),
        ("1/x", "its slope has no bound"),
        ("0.1+q", "'q' has no value here"),
        ("0.1+", "is not written in Python"),
        ("0", "expected a number > 0, or an expression such as 0.1+0.02*z"),
        ("x.real", "is not allowed"),
        ("import os", "is not written in Python"),
    ],
)
def test_what_is_refused(value: str, error: str) -> None:
    with pytest.raises(SceneError) as caught:
        reads(f'<scene version="1"><solid size="2cm">\n<gyroid thickness="{value}"/></solid></scene>')
    line = str(caught.value)
    assert line.startswith("scene:2: <gyroid> thickness=") and error in line and "\n" not in line


@pytest.mark.parametrize(
    "value", [lambda p: 3, lambda p: min(p.x, 1), lambda p: np.floor(p.x), lambda p: p.q]
)
def test_functions_that_are_refused(value: object) -> None:
    with pytest.raises(SceneError, match=r"expected a number > 0, or an expression such as 0\.1\+0\.02\*z: "):
        gyroid(thickness=value)


def test_a_fractal_has_seams_of_one_width() -> None:
    with pytest.raises(SceneError, match="expected a number, as an element is a fractal"):
        union(mandelbulb(iterations=3), sphere(), smooth="0.1+0.1*z")


def test_numbers_are_read_as_before() -> None:
    assert Variable(None, "", above=0).read(" 0.5 ") == Number(None, "", above=0).read("0.5") == 0.5
