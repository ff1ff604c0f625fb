"""Escape-time fractals from their step: what the text of a step implies."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice import formulas
from fracslice.errors import KernelError, SceneError
from fracslice.fields import maps as verbs
from fracslice.fields import orbit_code
from fracslice.fields.cpu import compile_scene
from fracslice.fields.depth import resolve_depths
from fracslice.fields.devices import reference
from fracslice.fields.growth import image
from fracslice.fields.linker import link
from fracslice.fields.maps import ball, fold, positive, power, turn
from fracslice.fields.node import FORMULAS
from fracslice.fields.orbits import growth_of, orbit, steps
from fracslice.fields.steps import Term, trace
from fracslice.formulas import Number, Vector, bristorbrot, julia, mandelbox, quaternion_mandelbrot
from tests.benchmarks.formulas.steps import SCENES
from tests.budgets.instructions import assembly, sizes

pytestmark = pytest.mark.once

SHIFT = (0.3, -0.2, 0.1)
RNG = np.random.default_rng(0)


@pytest.fixture(autouse=True)
def forgotten():  # type: ignore[no-untyped-def]
    """Formulas of a test are forgotten after it."""
    known = dict(FORMULAS)
    yield
    FORMULAS.clear()
    FORMULAS.update(known)


def box_step(w, c, scale):  # type: ignore[no-untyped-def]
    return scale * ball(fold(w, 1.0), 0.5) + c


def square(w, c):  # type: ignore[no-untyped-def]
    x, y, z = w
    return (x * x - y * y - z * z, 2.0 * x * y, 2.0 * x * z) + c


def bristor(w, c):  # type: ignore[no-untyped-def]
    x, y, z = w
    return (x * x - y * y - z * z, y * (2.0 * x - z), z * (2.0 * x + y)) + c


def mixed(w, c):  # type: ignore[no-untyped-def]
    x, y, z = turn(w, (0.0, 0.6, 0.8), 35.0)
    r = np.sqrt(x * x + y**2 + 1.5)
    for k in range(2):
        x = x + k * np.sin(y / r) * np.exp(-0.1 * z * z)
    u = (np.where(x > y, 2 * x, y + x), np.arctan2(z, r) * r, abs(z) - max(x, -y) / 2)
    return 1.5 * u - SHIFT + 0.5 * c


def triplex(w, c):  # type: ignore[no-untyped-def]
    return power(positive(w), 3.0) + c


def either(w, c):  # type: ignore[no-untyped-def]
    x, y, z = w
    return np.where(x > y, 2.0 * ball(w, 0.5), turn(w, (0.0, 0.6, 0.8), 35.0)) + c


def traced(step, sizes: dict[str, int]):  # type: ignore[no-untyped-def]
    """Code of a step, and a function of points and constants that returns its images and stretches."""
    made = trace(step, sizes, {})

    def run(x, y, z, a, b, c, *values):  # type: ignore[no-untyped-def]
        constant = (a, b, c)
        return made.taken((x, y, z), constant, values, made.prepared(constant, values))

    return made, run


def jacobian(run, w, c, values, by: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Central differences [3, 3, n] by w or c."""
    h, columns = 1e-6, []
    for k in range(3):
        ends = []
        for sign in (1, -1):
            moved = [w.copy(), c.copy()]
            moved[by][k] += sign * h
            ends.append(np.array(np.broadcast_arrays(*run(*moved[0], *moved[1], *values)[0], w[0])[:3]))
        columns.append((ends[0] - ends[1]) / (2 * h))
    return np.stack(columns, axis=1)


@pytest.mark.parametrize(
    ("step", "values", "most"),
    [
        (box_step, {"scale": -1.5}, 1.001),
        (square, {}, 1.1),
        (bristor, {}, 1.12),
        (mixed, {}, 1.12),
        (triplex, {}, 1.001),
    ],
)
def test_the_stretch_bounds_the_jacobian(step, values, most: float) -> None:  # type: ignore[no-untyped-def]
    """Exact for similarities; an eighth too large for others."""
    _, run = traced(step, dict.fromkeys(values, 1))
    w, c = RNG.uniform(-2, 2, (2, 3, 2000))
    given = list(values.values())
    stretches = [np.broadcast_to(s, 2000) for s in run(*w, *c, *given)[1:]]
    for by, stretch in enumerate(stretches):
        true = np.linalg.norm(jacobian(run, w, c, given, by).transpose(2, 0, 1), 2, axis=(1, 2))
        assert (stretch >= true * (1 - 1e-4) - 1e-6).all()
        assert np.quantile(stretch / np.maximum(true, 1e-9), 0.9) < most


def test_verbs_need_no_derivatives() -> None:
    """Stretches multiply: nothing of the Jacobian is left in the code."""
    made, _ = traced(box_step, {"scale": 1})
    used = {made.terms[place].op for place in made.needed([*made.point, *made.stretch])}
    assert used.isdisjoint({"sqrt", "where"})
    assert made.terms[made.stretch[1]] == Term("constant", data=1.0)


def test_a_choice_of_two_points_has_the_stretch_of_the_one_that_is_taken() -> None:
    made, run = traced(either, {})
    assert "sqrt" not in {made.terms[place].op for place in made.needed([*made.stretch])}
    points = np.array([(0.1, 0.2, 0.0), (0.2, 0.1, 0.0)]).T
    assert run(*points, *points)[1].tolist() == [1, 8]


def test_zeros_and_constants_leave_no_code() -> None:
    """Terms that are zero or cancel are left out; what does not depend on the point is before the loop."""

    def planar(w, c, size):  # type: ignore[no-untyped-def]
        x, y, z = w
        return np.sqrt(size) * (x * x - y * y, 2.0 * x * y, 0.0 * z + 3.0) + c

    made = traced(planar, {"size": 1})[0]
    assert [made.terms[place].op for place in made.ready] == ["sqrt", "mul", "add"]
    needed = [made.terms[place] for place in made.needed([*made.point, *made.stretch])]
    assert not any(term.data == "wz" or term.op == "absolute" for term in needed)


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("Mandelbox 2", 1.1),
        ("KIFS tetrahedron", 1.0),
        ("Mandelbulb 8", 0.9),
        ("Julia, differentiated", 1.75),
        ("Bristorbrot", 2.1),
    ],
)
def test_a_step_needs_few_more_instructions_than_a_field_by_hand(name: str, most: float) -> None:
    """`formulas.steps` measures the time: at most 1.15 times with verbs, 1.5 without."""
    _, step, hand = SCENES[name]
    (mine, _), (others, _) = (sizes(assembly(link(root), 32)) for root in (step, hand))
    assert mine <= most * others


def test_a_returned_stretch_is_taken() -> None:
    def declared(w, c):  # type: ignore[no-untyped-def]
        x, y, z = w
        return (2.0 * x, 2.0 * z, 2.0 * y) + c, 2.5

    made = traced(declared, {})[0]
    assert [made.terms[place].data for place in made.stretch] == [2.5, 1.0]


ARGUMENTS = {
    fold: (1.0,),
    verbs.fold_to: ((1.0, 0.5, 2.0),),
    ball: (0.5,),
    verbs.inversion: (1.2,),
    positive: (),
}
ARGUMENTS |= {verbs.mirror: ((0.6, 0.0, 0.8),), turn: ((0.0, 0.6, 0.8), 40.0), power: (5.0,)}


@pytest.mark.parametrize("verb", ARGUMENTS)
@pytest.mark.parametrize("e", [0.001, 0.3])
def test_the_stretch_over_a_ball_bounds_its_image(verb, e: float) -> None:  # type: ignore[no-untyped-def]
    w = RNG.uniform(-1.5, 1.5, (3, 3000))
    step = RNG.normal(size=(3, 3000))
    inside = w + e * step / np.linalg.norm(step, axis=0) * RNG.uniform(0, 1, 3000)
    (image, stretch), (other, _) = (verb(p, *ARGUMENTS[verb]) for p in (w, inside))
    over = verbs.OVER[verb](w, e, *ARGUMENTS[verb]) if verb in verbs.OVER else stretch
    moved = np.linalg.norm(np.array(image) - np.array(other), axis=0)
    assert (
        moved <= np.broadcast_to(over, 3000) * np.linalg.norm(inside - w, axis=0) * (1 + 1e-9) + 1e-12
    ).all()


def test_growth_is_found() -> None:
    assert not growth_of(mandelbox()).by_power
    assert growth_of(bristorbrot()).power == pytest.approx(2, abs=0.01)
    assert growth_of(bristorbrot()).escape < 4


@pytest.mark.parametrize(
    "root", [mandelbox(iterations=9), mandelbox(scale=-1.5, iterations=9), bristorbrot(iterations=9)]
)
def test_orbits_do_not_come_back(root) -> None:  # type: ignore[no-untyped-def]
    result, p = growth_of(root), RNG.uniform(-0.57, 0.57, (3, 20000)) * root.bounds.box.hi[0]
    taken, given = steps(root)
    step = image(taken, 0, given)
    w, gone = p, np.zeros(20000, bool)
    for _ in range(12):
        w = step(w, p)
        size = np.linalg.norm(w, axis=0)
        assert (size[gone] > result.escape).all()
        gone |= size > result.escape


def test_orbits_that_stay_are_refused() -> None:
    with pytest.raises(SceneError, match=r"<mandelbox> has orbits that do not escape"):
        mandelbox(scale=1.0).bounds  # noqa: B018


def test_the_quaternion_set_is_that_of_the_complex_numbers_turned() -> None:
    root = quaternion_mandelbrot(iterations=12)
    x, y, z = RNG.uniform(-1.6, 1.0, (3, 4000))
    c = x + 1j * np.hypot(y, z)
    w = c.copy()
    for _ in range(12):
        w = np.where(abs(w) < 1e6, w * w + c, w)
    inside = abs(w) <= growth_of(root).escape
    assert ((compile_scene(root, "float64").points(x, y, z) < 0) == inside).mean() > 0.9995


def test_a_julia_set_is_that_of_the_formula_by_hand() -> None:
    a = quaternion_mandelbrot(iterations=14, julia=(-0.2, 0.8, 0.0))
    b = julia(iterations=14, c=(-0.2, 0.8, 0, 0))
    p = RNG.uniform(-1.5, 1.5, (3, 20000))
    inside = [compile_scene(root, "float64").points(*p) < 0 for root in (a, b)]
    assert inside[1].sum() > 200
    assert (inside[0] != inside[1]).sum() <= 0.05 * inside[1].sum()


def test_parameters_of_every_kind() -> None:
    from fracslice.formulas import Count

    @orbit(
        way=Vector((0.1, 0.2, 0.3), "offset"),
        factor=Number(2.0, "scale"),
        often=Count(2, "folds", least=1, most=5),
    )
    def own(w, c, way, factor, often):  # type: ignore[no-untyped-def]
        """Own."""
        for _ in range(often):
            w = fold(w, 1.0) + way
        return factor * w + c

    p = RNG.uniform(-3, 3, (3, 500))
    for root in (
        own(iterations=3),
        own(iterations=3, often=1, factor=-2.0),
        own(iterations=2, julia=(1, 0, 0)),
    ):
        expected = reference(root)(*p)
        np.testing.assert_allclose(
            compile_scene(root, "float64").points(*p), expected, rtol=1e-12, atol=1e-12
        )
    assert link(own(iterations=3)).program == link(own(iterations=4, way=(0, 0, 1))).program


def test_a_mistake_is_one_line_with_its_place() -> None:
    @orbit()
    def wrong(w, c):  # type: ignore[no-untyped-def]
        return w * w + c

    with pytest.raises(
        KernelError, match=r"test_orbits.py:\d+: step wrong: 'return w \* w \+ c' .*: expected a "
    ):
        wrong(iterations=2)


@pytest.mark.parametrize("scale", [2.0, -1.5])
def test_an_automatic_depth_grows_with_the_detail(scale: float) -> None:
    depths = [resolve_depths(mandelbox(scale=scale), detail)["iterations"] for detail in (0.4, 0.1, 0.025)]
    assert depths[0] < depths[1] < depths[2] < 30


def test_a_torn_hybrid_is_not_skipped_by_its_bound() -> None:
    """Its slope has no limit at the tears of an even power; that of the formula alone is measured."""
    points = np.random.default_rng(3).uniform(-3, 3, (3, 500))
    cosines = formulas.cosine_bulb(power=6, iterations=2)
    torn = formulas.orbit(formulas.kifs_dodecahedron(), formulas.cosine_bulb(power=6), iterations=2)
    for root, skips in ((torn, False), (cosines, True)):
        assert reference(root)(*points).max() > 0
        assert (reference(root.conservative())(*points).max() > 0) == skips


def test_the_code_of_a_step_is_cached(monkeypatch: pytest.MonkeyPatch) -> None:
    """Following the text of the Mandelbulb's takes a twentieth of a small picture."""
    bulbs = [steps(formulas.mandelbulb(power=power), alone=False)[0][0] for power in (5, 6)]
    made = [code.stage for code in bulbs]
    assert made[0] != made[1]
    orbit_code._trace_step.cache_clear()
    monkeypatch.setattr(orbit_code, "trace", None)
    assert [code.stage for code in bulbs] == made
