"""Measured in space: thickness, gaps, bodies and cavities of shapes that are known, and what `<print>` makes
of them; meshes and slices of the same scene agree.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice.checks.problems import Limits, Problem
from fracslice.checks.solid_checks import SolidReport, check_object
from fracslice.errors import VolumeError
from fracslice.formulas import (
    Node,
    bend,
    bounds,
    box,
    cone,
    cylinder,
    difference,
    julia,
    mandelbulb,
    menger,
    repeat,
    shell,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.printing import printable
from fracslice.printing.edits import frame_bodies
from fracslice.printing.walls import Samples, Widths, components_of, walls
from fracslice.scene import Print, scene
from fracslice.slicing import SliceJob, plan_stack
from fracslice.slicing.layers import Slicer
from fracslice.volume import Drain, Plan, plan, sample_scene
from fracslice.volume.amount import Sizing
from fracslice.volume.bricks import from_grid, to_grid
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once

SIZE = 20.0


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


def distances(planned: Plan) -> Samples:
    return Samples(from_grid(to_grid(sample_scene(planned)).redistance()))


def made(root: Node, **printing: float | str) -> tuple[Samples, float]:
    """The distances of a printable object of 20 mm on 0.2 mm samples, and its scale."""
    how, planned = Print(**printing), plan(root, 100)  # type: ignore[arg-type]
    if how.bodies is not None:
        planned = frame_bodies(planned, Sizing(SIZE), how.bodies, Work())
    thing, scale = printable(planned, Sizing(SIZE), how)
    return distances(thing), scale


def measured(root: Node, gaps: bool = False, **printing: float | str) -> np.ndarray:
    """Thicknesses up to 3 mm, in mm."""
    solid, scale = made(root, **printing)
    return walls(solid, 3 / scale, Work(), gaps=gaps).width * scale


PLATE = union(box(size=(2, 2, 1)), at(box(size=(0.06, 2, 1)), 0, 0, 0.9))
TWO = union(at(box(size=(0.45, 1, 1)), -0.275, 0, 0), at(box(size=(0.45, 1, 1)), 0.275, 0, 0))


@pytest.mark.parametrize(
    ("root", "thick", "longest"),
    [
        (box(size=(2, 2, 0.1)), 0.1, 2),
        (transform(box(size=(2, 2, 0.1)), rotate=(1, 2, 3, 37)), 0.1, None),
        (shell(sphere(), thickness=0.1), 0.1, 2.1),
        (torus(radius=1, tube=0.08), 0.16, 2.16),
        (transform(box(size=(2, 2, 0.3)), scale=(1, 1, 1 / 3)), 0.1, 2),
    ],
    ids=["plate", "tilted", "shell", "torus", "no distance"],
)
def test_walls_of_known_thickness(root: Node, thick: float, longest: float | None) -> None:
    planned = plan(root, 100)
    solid = distances(planned)
    result = walls(solid, 0.3, Work())
    assert np.quantile(result.width, (0.05, 0.5)) == pytest.approx([thick] * 2, abs=planned.voxel)


def test_places_of_problems_have_no_negative_zero() -> None:
    assert str(Problem("wall", "a wall", at=(-0.001, 0.004, -1.0))) == "a wall: at 0.00 0.00 -1.00 mm"


def test_a_cube_has_no_thin_walls_at_its_edges() -> None:
    assert len(measured(box())) == 0
    assert len(measured(box(), gaps=True)) == 0


def test_thin_walls_become_as_thick_as_asked() -> None:
    assert np.median(measured(PLATE)) == pytest.approx(0.6, abs=0.2)
    after = measured(PLATE, thickness=1.5)
    assert np.quantile(after, (0.01, 0.5)) == pytest.approx([1.5, 1.5], abs=0.2)
    assert len(measured(box(), thickness=2)) == 0


def test_what_is_thick_enough_stays_as_it_is() -> None:
    planned = plan(box(), 100)
    thing, scale = printable(planned, Sizing(SIZE), Print(thickness=2))
    assert (thing.root, scale) == (planned.root, pytest.approx(20))


@pytest.mark.parametrize(("gap", "bodies"), [(1.7, 2), (2.3, 1)])
def test_gaps_up_to_the_limit_are_closed(gap: float, bodies: int) -> None:
    """They are 2 mm wide."""
    solid, scale = made(TWO, gap=gap)
    components = components_of(solid.bricks)
    assert len(components.bodies) == bodies
    volume = components.count[components.inside].sum() * (solid.bricks.voxel * scale) ** 3
    assert volume == pytest.approx(8000 if bodies == 1 else 7200, rel=0.03)


def test_loose_bodies_are_joined_by_struts_across_the_middle() -> None:
    after = measured(TWO, bridge=1.5)
    assert np.median(after) == pytest.approx(1.5, abs=0.2)
    solid, _ = made(union(TWO, at(sphere(radius=0.1), 0, 0, 0.8)), bridge=1.5)
    assert len(components_of(solid.bricks).bodies) == 1


def test_dust_is_dropped_where_one_body_is_asked_for() -> None:
    """From layers too: none of their tools drops what it finds."""
    dusty = union(TWO, at(sphere(radius=0.0115), 0, 0, 0.8))
    thing, _ = printable(plan(dusty, 100), Sizing(SIZE), Print(bridge=1.5))
    before, after = (
        components_of(sample_scene(plan(dusty, 200))),
        components_of(sample_scene(replace(thing, voxel=0.005))),
    )
    assert (len(before.bodies), len(after.bodies)) == (3, 1)


def test_cavities_are_filled_and_bodies_dropped() -> None:
    holed = union(
        difference(box(), at(sphere(radius=0.2), 0.1, 0, 0)), at(box(size=(0.2, 0.2, 0.2)), 0.8, 0, 0)
    )
    before = components_of(made(holed)[0].bricks)
    assert (len(before.bodies), len(before.cavities)) == (2, 1)
    solid, scale = made(holed, cavities="fill", keep="largest")
    after = components_of(solid.bricks)
    assert (len(after.bodies), len(after.cavities)) == (1, 0)
    assert scale == pytest.approx(20, rel=0.01)
    assert after.count[after.bodies[0]] * (solid.bricks.voxel * scale) ** 3 == pytest.approx(8000, rel=0.03)


def test_lengths_that_cannot_be_measured() -> None:
    with pytest.raises(
        VolumeError, match=r"0.01 mm is too small for an object of 20 mm: expected at least 0.0625 mm"
    ):
        printable(plan(box(), 100), Sizing(SIZE), Print(thickness=0.01))


@pytest.mark.parametrize(
    ("resolution", "layer", "error"), stamped([(64, 0.2, 0.02), (128, 0.1, 0.01)], [(64, 0.2, 0.02)])
)
def test_mesh_and_slices_agree(resolution: int, layer: float, error: float) -> None:
    how = Print(bridge=2, thickness=1.2, hollow=1.5, drain=2, base=0.5, raft=1)
    thing = scene(union(PLATE, at(sphere(radius=0.2), 1.5, 0, 0)), size="20mm", printing=how)
    mesh = make_mesh(thing, MeshJob(resolution=resolution))
    assert mesh.report.problems == ()
    stack = plan_stack(thing.root, SliceJob(size=20, layer=layer, pixel=(layer, layer), printing=how))
    volume = sum(Slicer(stack).map(lambda layer: layer.area * layer.height))
    assert volume == pytest.approx(mesh.report.mesh.volume_mm3, rel=error)
    assert mesh.mesh.size == pytest.approx(stack.size, abs=0.3)


def checked(root: Node, size: float = SIZE) -> SolidReport:
    planned = plan(root, 100)
    limits = Limits(wall=0.5, floor=0.5)
    return check_object(planned.root, planned.outer, size / max(planned.box.size), limits)


@pytest.mark.parametrize(
    ("root", "problem"),
    [
        (box(), None),
        (transform(box(), rotate=(1, 2, 3, 37)), None),
        (sphere(), None),
        (union(box(size=(2, 2, 0.5)), at(box(size=(2, 0.03, 1)), 0, 0, 0.6)), "walls are thinner"),
        (union(box(size=(1, 1, 2)), at(box(size=(2, 1, 0.03)), 0, 0, 0.5)), "floors are thinner"),
    ],
)
def test_seeded_defects_are_found_and_clean_solids_not_blamed(root: Node, problem: str | None) -> None:
    result = checked(root).problems
    assert result == [] if problem is None else any(problem in str(p) for p in result)


TUBE = difference(cylinder(radius=0.8, height=1.6), cylinder(radius=0.7, height=2))


@pytest.mark.parametrize(
    ("root", "measured", "width"),
    [
        (shell(sphere(), thickness=0.1), "walls", 0.1),
        (transform(TUBE, rotate=(1, 2, 3, 37)), "walls", 0.1),
        (bend(box(size=(0.1, 2, 2)), axis="y", degrees=40), "walls", 0.1),
        (transform(box(size=(2, 2, 0.4)), scale=(1, 1, 0.25), rotate=(1, 2, 3, 37)), "walls", 0.1),
        (transform(TWO, rotate=(1, 2, 3, 37)), "gaps", 0.1),
    ],
    ids=["shell", "tube", "steep", "squeezed", "gap"],
)
def test_what_is_some_samples_thick_is_measured_on_the_field(root: Node, measured: str, width: float) -> None:
    """Eight samples, about, of fields steeper than distances and flatter, too."""
    scale = SIZE / max(plan(root, 100).box.size)
    result: Widths = getattr(checked(root), measured)
    assert result.thinnest_hundredth == pytest.approx(width * scale, rel=2e-3)
    assert result.median == pytest.approx(width * scale, rel=1e-4)


def test_holes_of_a_sponge_are_measured() -> None:
    """Walls and gaps are a 27th wide, or two of them; counted in cells of the sponge."""
    report = checked(menger(level=3))
    for result, area in ((report.walls, 4635.4), (report.gaps, 5267.5)):
        assert result and result.thinnest_hundredth == pytest.approx(SIZE / 27, rel=0.02)
        assert area * 0.55 < result.counts[14] < area  # from 0.70 to 0.75 mm


def fin(width: float) -> tuple[Node, float]:
    """A fin on a plate, and the area of both faces."""
    upright = at(box(size=(1.4, width, 1.5)), 0, 0.003, 0.75)
    return union(box(size=(2, 2, 0.5)), upright), 2 * 1.4 * 1.25


def slot(width: float) -> tuple[Node, float]:
    """A slot into a block, and the area of both faces."""
    return difference(box(size=(2, 2, 1.5)), at(box(size=(3, width, 2)), 0, 0.003, 1)), 2 * 2 * 0.75


@pytest.mark.parametrize("tilt", [0.0, 17.0])
@pytest.mark.parametrize("voxels", [0.3, 0.6, 1.0, 2.0, 2.9])
@pytest.mark.parametrize(("made", "measured"), [(fin, "walls"), (slot, "gaps")], ids=["wall", "gap"])
def test_what_is_thinner_than_the_samples_is_found(
    made: Callable[[float], tuple[Node, float]], measured: str, voxels: float, tilt: float
) -> None:
    """Its width, in voxels of the check, and its area."""
    width = voxels * 2.1 / 96
    root, area = made(width)
    report, scale = tilted(root, tilt)
    result: Widths = getattr(report, measured)
    assert result.median == pytest.approx(width * scale, rel=0.02)
    assert sum(result.counts) == pytest.approx(area * scale**2, rel=0.15)
    assert measured == "gaps" or report.thin_walls == pytest.approx(area * scale**2, rel=0.15)


def tilted(root: Node, degrees: float) -> tuple[SolidReport, float]:
    """A check of an object turned by so much, as coarse as may be, and its scale."""
    planned = plan(transform(root, rotate=(1, 0.3, 0.2, degrees)), 96)
    scale = SIZE / max(planned.box.size)
    voxel = max(planned.outer.size) * scale / 96
    return check_object(planned.root, planned.outer, scale, Limits(wall=4 * voxel, floor=1)), scale


def test_walls_thinner_than_the_samples_are_thickened() -> None:
    """A fin of 0.1 mm where samples are 0.25 mm apart."""
    thin = union(box(size=(2, 2, 0.5)), at(box(size=(1.4, 0.01, 1.5)), 0, 0.003, 0.75))
    after = measured(thin, thickness=1.5)
    assert np.quantile(after, (0.02, 0.5)) == pytest.approx([1.5, 1.5], abs=0.2)
    assert len(after) > 1000


@pytest.mark.nightly
def test_walls_of_many_samples_are_thickened_alike() -> None:
    """A fin of 1.4 mm, nine samples thick."""
    thin = union(box(size=(2, 2, 0.5)), at(box(size=(1.4, 0.14, 1.5)), 0, 0.003, 0.75))
    after, before = (measured(thin, **how) for how in ({"thickness": 2.5}, {}))
    assert np.quantile(before, (0.05, 0.5)) == pytest.approx([1.4, 1.4], abs=0.1)
    assert np.quantile(after, (0.05, 0.5)) == pytest.approx([2.5, 2.5], abs=0.2)


def test_gaps_thinner_than_the_samples_are_closed() -> None:
    """A gap of 0.1 mm where samples are 0.2 mm apart."""
    boxes = union(at(box(size=(1, 1, 0.995)), 0, 0, 0.5025), at(box(size=(1, 1, 0.995)), 0, 0, -0.5025))
    thing, _ = printable(plan(boxes, 96), Sizing(SIZE), Print(gap=0.5))
    middle = thing.root.kernel("cpu", "float64").points(
        *np.array([[0.0, 0.2, -0.4], [0, 0.3, 0.1], [0, 0, 0]])
    )
    assert (middle < 0).all()


def test_fractals_are_thickened() -> None:
    """Their values are far smaller than distances, so the raised field reaches far."""
    volumes = []
    for how in (Print(), Print(thickness=1.5)):
        thing = scene(mandelbulb(iterations=6), size="40mm", printing=how)
        volumes.append(make_mesh(thing, MeshJob(resolution=48)).report.mesh.volume_mm3)
    assert volumes[1] > 1.005 * volumes[0]


@pytest.mark.nightly
def test_gaps_of_fractals_are_closed() -> None:
    """Also between walls that their samples miss."""
    planned = plan(mandelbulb(iterations=6), 64)
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (3, 400_000))
    before, after = (
        root.kernel(precision="float64").points(*points) < 0
        for root in (planned.root, printable(planned, Sizing(40), Print(gap=1))[0].root)
    )
    assert after[before].all()
    assert 1.002 < after.sum() / before.sum() < 1.1


@pytest.mark.nightly
def test_time_is_linear_in_the_holes() -> None:
    """10^4 holes take at most a few times what 100 do, on as many samples."""

    def seconds(side: int) -> float:
        pitch = 2 / side
        rods = repeat(cylinder(radius=0.3 * pitch, height=1), period=(pitch, pitch, 4), count=(side, side, 1))
        plate = difference(box(size=(2, 2, 0.1)), bounds(rods, min=(-1, -1, -1), max=(1, 1, 1)))
        solid = distances(plan(plate, 300))
        begin = time.process_time()
        assert len(components_of(solid.bricks).bodies) == 1
        assert len(walls(solid, 0.02, Work(), gaps=True).width) > 0 or side < 100
        return time.process_time() - begin

    seconds(2)
    assert seconds(100) < 10 * seconds(10)


@pytest.mark.parametrize(
    "root",
    [
        pytest.param(sphere(), id="sphere"),
        pytest.param(julia(iterations=7), id="julia", marks=pytest.mark.nightly),
    ],
)
def test_a_millimetre_is_a_millimetre(root: Node) -> None:
    """What is cut off or stands below is exact, and so is the scale: they are the field's."""

    def made(**printing: float) -> tuple[np.ndarray, float]:
        how = Print(**printing)  # type: ignore[arg-type]
        result = make_mesh(scene(root, size="80mm", printing=how), MeshJob(resolution=64))
        return result.mesh.size, result.place.scale

    (plain, scale), (cut, _), (raft, same), (hollow, _) = (
        made(**how) for how in ({}, {"base": 1}, {"base": 1, "raft": 1.5}, {"hollow": 3, "drain": 0})
    )
    own = np.array(plan(root, 64).box.size) * scale
    assert own.max() == pytest.approx(80, abs=1e-3) and same == pytest.approx(scale, rel=1e-6)
    assert ((own - 1.25 < plain) & (plain <= own + 1e-3)).all()
    np.testing.assert_allclose(raft[:2], own[:2] + 16, atol=1e-3)
    lost = (own - plain)[2]  # at the top and at the bottom; what is cut off or added has no tip
    assert (plain[2] - 1e-3 <= cut[2] + 1 <= plain[2] + lost + 1e-3).all()
    assert raft[2] - cut[2] == pytest.approx(0.75, abs=lost + 1e-3)  # of other samples, too
    np.testing.assert_allclose(hollow, plain, atol=0.1)  # a tip of the other samples may end elsewhere


def holes(root: Node) -> tuple[Callable[..., bool], float]:
    """Hollowed to 2 mm, with holes of 3 mm: whether a point is solid; a millimetre."""
    thing, scale = printable(plan(root, 100), Sizing(SIZE), Print(hollow=2, drain=3))
    kernel = thing.root.kernel("cpu", "float64")
    return lambda *at: bool(kernel.points(*np.array(at)[:, None])[0] < 0), 1 / scale


def test_a_hollow_is_drained_and_not_a_pocket_below_it() -> None:
    solid, mm = holes(union(sphere(), at(sphere(radius=0.35), 0, 0, -1.3)))
    low = -1 + 3.5 * mm
    assert solid(0, 0, -1.3) and not solid(0, 0, 0)
    assert solid(0.7, 0, low) != solid(-0.7, 0, low) and solid(0, 0.7, low)
    assert not solid(0, 0, 1 - mm)


def test_each_large_part_of_a_hollow_is_drained() -> None:
    solid, mm = holes(union(*(at(sphere(), x, 0, 0) for x in (-0.95, 0.95))))
    for x in (-0.95, 0.95):
        assert not solid(x, 0, 0) and not solid(x, 0, 1 - mm)
        assert not solid(1.8 * x, 0, -1 + 3.5 * mm)


@pytest.mark.parametrize("resolution", stamped([24, 25, 40, 41, 64], [24, 25]))
def test_a_ball_is_drained_along_its_axis(resolution: int) -> None:
    drains = printable(plan(sphere(), resolution), Sizing(SIZE), Print(hollow=2, drain=3))[0].drains
    assert len(drains) == 2
    for drain in drains:
        assert np.hypot(*drain.start[:2]) < 0.1 * 2 / resolution


@pytest.mark.nightly
def test_a_flat_floor_is_drained_in_its_middle() -> None:
    solid, mm = holes(box(size=(2, 2, 2)))
    assert not solid(0, 0, 1 - mm) and not (solid(1 - mm, 0, 3.5 * mm - 1) and solid(mm - 1, 0, 3.5 * mm - 1))
    rims = np.linspace(-1, 1, 50) * (1 - mm / 4)
    edges = [(x, y, z) for x in (rims[0], rims[-1]) for y in (rims[0], rims[-1]) for z in rims]
    assert all(solid(*edge) for edge in edges)


def test_layers_are_as_large_as_asked() -> None:
    """Of a solid whose box no formula tells: its contours, across and along, with a base cut off."""
    root = transform(
        difference(box(size=(2, 1, 1)), at(box(size=(4, 4, 4)), 2.7137, 0, 0)), rotate=(0, 0, 1, 9)
    )
    stack = plan_stack(root, SliceJob(size=40, layer=0.5, pixel=(0.1, 0.1), printing=Print(base=1)))
    points = next(Slicer(stack).map(lambda layer: layer.contours.points, [len(stack.z) // 2]))
    np.testing.assert_allclose(np.ptp(points, axis=0), stack.size[:2], atol=2e-3)
    assert max(stack.size) == pytest.approx(40, abs=1e-3)


@pytest.mark.nightly
def test_a_base_loads_no_numba() -> None:
    code = """
import sys
from fracslice import MeshJob, make_mesh
from fracslice.formulas import sphere
from fracslice.scene import Print, scene
make_mesh(scene(sphere(), size="20mm", printing=Print(base=1, raft=1)), MeshJob(resolution=32))
print("numba" in sys.modules)"""
    printed = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert printed.stdout == "False\n"


def test_a_raft_that_no_voxel_holds_is_refused() -> None:
    with pytest.raises(VolumeError, match=r"a raft of 0.2 mm: expected at least a voxel, 0.3125 mm"):
        printable(plan(box(), 64), Sizing(SIZE), Print(raft=0.2))


def test_the_sharp_rim_of_a_drain_hole_is_no_thin_wall() -> None:
    hole = transform(cylinder(radius=1, height=22), translate=(0, 0, 5))
    thing = plan(difference(cone(radius=6, height=22), hole), 100)
    drain = Drain((0, 0, -6), (0, 0, 12), 1.0)
    rims, none = (check_object(thing.root, thing.outer, 1, drains=drains) for drains in ((), (drain,)))
    assert [p.kind for p in rims.problems] == ["walls"] and none.problems == []


def bored(*cuts: Node) -> Node:
    """A cube of 10 mm less some shapes."""
    return difference(box(size=(10, 10, 10)), *cuts)


BORE = cylinder(radius=0.2, height=12)
SLOT = transform(box(size=(0.4, 12, 8)), translate=(0, 0, 2))


def holes_of(root: Node, size: float = 10, drains: Sequence[Drain] = ()) -> str:
    planned, coarse = plan(root, 100), Limits(wall=0.5, floor=0.5)
    scale = size / max(planned.box.size)
    return check_object(planned.root, planned.outer, scale, coarse, drains=drains, origin=(0, 0, -5)).holes


@pytest.mark.parametrize(
    ("turn", "along", "at"),
    [((1, 0, 0, 0), 2, (1, 2)), ((0, 1, 0, 90), 0, (2, 8)), ((1, 0, 0, 90), 1, (1, 8))],
)
def test_a_narrow_bore_is_named_with_its_place(
    turn: tuple[float, ...], along: int, at: tuple[float, ...]
) -> None:
    text = holes_of(bored(transform(BORE, rotate=turn, translate=(1, 2, 3))))
    assert text.startswith("1 hole of 0.4 mm, narrower than 0.5 mm, may close: at ")
    place = [float(number) for number in text.split()[-4:-1]]
    away = np.delete(place, along) - at
    assert np.abs(away).max() < 0.05 and -5 < place[along] < 10


def test_several_narrow_bores_are_counted_and_the_narrowest_is_named() -> None:
    narrower = transform(cylinder(radius=0.15, height=12), translate=(3, 0, 0))
    into_a_cavity = bored(sphere(radius=2), transform(BORE, translate=(0, 0, 6)), narrower)
    assert holes_of(into_a_cavity).startswith(
        "2 holes of 0.3 mm, narrower than 0.5 mm, may close: at 3.00 0.0"
    )


def test_what_is_wider_or_narrow_in_one_direction_is_no_narrow_hole() -> None:
    dent = transform(sphere(radius=0.2), translate=(0, 0, 5))
    assert [holes_of(bored(cut)) for cut in (cylinder(radius=0.4, height=12), SLOT, dent)] == [""] * 3


def test_a_drain_hole_is_not_named_twice() -> None:
    assert holes_of(bored(BORE), drains=[Drain((0, 0, -6), (0, 0, 6), 0.2)]) == ""


def test_a_menger_sponge_has_one_line_on_its_narrow_holes() -> None:
    sponge = menger(level=2)
    line = holes_of(sponge, 4)
    assert " of 0.44 mm, narrower than 0.5 mm, may close" in line and "\n" not in line
    assert holes_of(sponge, 5) == ""
