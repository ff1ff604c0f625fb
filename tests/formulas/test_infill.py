"""Lattices of a given share of space, and solids that are filled with them."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from fracslice import make_mesh, reads
from fracslice.errors import SceneError
from fracslice.fields.devices import reference
from fracslice.formulas import (
    Node,
    box,
    get,
    gyroid,
    infill,
    mandelbulb,
    onion,
    schwarz_p,
    shell,
    sphere,
    struts,
    thicken,
)
from fracslice.formulas.lattices import STRUTS

from ..examples import WALLS, stamped

pytestmark = pytest.mark.once

SIDE = 128
LATTICES = [wall.name for wall in WALLS] + list(STRUTS)


def lattice(name: str, **values: object) -> Node:
    return struts(kind=name, **values) if name in STRUTS else get(name)(**values)


def share(root: Node, period: float) -> float:
    """Share of a cell that is solid, by other samples than those of the formula."""
    rng = np.random.default_rng(11)
    cubes = np.stack(np.unravel_index(np.arange(SIDE**3), (SIDE,) * 3))
    points = period * (cubes + rng.random(cubes.shape)) / SIDE
    return float((root.kernel(precision="float64").points(*points) < 0).mean())


@pytest.mark.parametrize(
    ("name", "fraction"),
    stamped(product(LATTICES, (0.1, 0.3, 0.7)), [("gyroid", 0.1), ("split_p", 0.3), ("octet", 0.7)]),
)
def test_a_lattice_fills_its_share_of_space(name: str, fraction: float) -> None:
    root = lattice(name, volume_fraction=fraction, period=1.7)
    assert share(root, 1.7) == pytest.approx(fraction, rel=2e-3)


@pytest.mark.parametrize("name", stamped(LATTICES, {"neovius", "kelvin"}))
def test_a_period_follows_from_a_thickness(name: str) -> None:
    """As does a thickness from a period; walls are as thick as asked at their thinnest."""
    root = lattice(name, volume_fraction=0.2, thickness=0.3)
    given = root.arguments
    period = given["period"] if "period" in given else 2 * np.pi / given["k"]
    assert share(root, period) == pytest.approx(0.2, rel=2e-3)
    points = np.random.default_rng(1).uniform(-2, 2, (3, 1000))
    other = lattice(name, period=period, thickness=0.3)
    assert reference(root)(*points) == pytest.approx(reference(other)(*points), abs=1e-12)


def test_a_known_share() -> None:
    """Struts along the edges of cubes: three cylinders, less what they have in common."""
    r = 0.1
    known = 3 * np.pi * r**2 - 8 * np.sqrt(2) * r**3
    root = struts(kind="cubic", volume_fraction=known)
    assert root.arguments["radius"] == pytest.approx(r, rel=1e-3)


@pytest.mark.nightly
def test_a_mesh_has_the_share() -> None:
    """In a cube of whole cells, by the volume of its triangles."""
    cube = box(size=(2, 2, 2)) & gyroid(volume_fraction=0.25)
    mesh = make_mesh(cube, resolution=49)
    assert mesh.volume / np.ptp(mesh.vertices[:, 0]) ** 3 == pytest.approx(0.25, rel=6e-3)


def test_the_field_of_an_infill_is_that_of_a_wall_and_what_is_behind() -> None:
    ball, filler = sphere(radius=1.2), schwarz_p(period=0.5, volume_fraction=0.3)
    root = infill(ball, filler, shell=0.15)
    points = np.random.default_rng(2).uniform(-1.3, 1.3, (3, 20_000))
    wall, within = reference(shell(ball, thickness=0.15)), reference(ball & filler)
    np.testing.assert_array_equal(reference(root)(*points), np.minimum(wall(*points), within(*points)))
    assert root.bounds.box == ball.bounds.box and root.bounds.lipschitz == 1
    assert make_mesh(root, resolution=25).is_watertight


def distance_kept(root: Node) -> None:
    """Assert that the field keeps its bound, and the box holds the inside."""
    rng = np.random.default_rng(4)
    points, steps = rng.uniform(-1.4, 1.4, (3, 20_000)), rng.normal(0, 1e-4, (3, 20_000))
    values, moved = reference(root)(*points), reference(root)(*(points + steps))
    steepest = (abs(moved - values) / np.linalg.norm(steps, axis=0)).max()
    assert 0.9 * root.bounds.lipschitz < steepest <= root.bounds.lipschitz * (1 + 1e-9)
    low, high = (np.array(corner)[:, None] for corner in (root.bounds.box.lo, root.bounds.box.hi))
    assert ((low <= points) & (points <= high)).all(0)[values < 0].all()


def test_an_infill_is_denser_below_the_surface() -> None:
    ball, filler = sphere(radius=1.2), schwarz_p(period=0.5, thickness=0.05)
    root = infill(ball, filler, shell=0.1, denser=0.12, within=0.5)
    distance_kept(root)
    points = np.random.default_rng(2).uniform(-1.2, 1.2, (3, 20_000))
    depth = -reference(ball)(*points)
    thick = 0.06 * np.clip(1 - depth / 0.5, 0, 1)
    known = (depth > 0) & ((depth < 0.1) | (reference(filler)(*points) < thick))
    np.testing.assert_array_equal(reference(root)(*points) < 0, known)


def test_a_lattice_is_thicker_in_another_element() -> None:
    lattice, ball = gyroid(period=0.7, thickness=0.05), sphere(0.4)
    root = thicken(lattice, ball, by=0.16, within=0.5)
    distance_kept(root)
    points = np.random.default_rng(2).uniform(-1.2, 1.2, (3, 20_000))
    away = np.clip(1 - reference(ball)(*points) / 0.5, 0, 1)
    np.testing.assert_allclose(
        reference(root)(*points), reference(lattice)(*points) - 0.08 * away, atol=1e-12
    )
    distance_kept(thicken(sphere(0.2).scale((1, 1, 5)), ball, by=0.4, within=0.8))  # clipped
    thinner = thicken(sphere(1.0), ball, by=-0.2, within=1.0)
    assert thinner.bounds.box.hi == (1, 1, 1) and thinner.distance((0, 0, 0.99)) > 0


def test_walls_of_an_onion_follow_the_surface() -> None:
    root = onion(sphere(1.2), period=0.3, thickness=0.1)
    distance_kept(root)
    points = np.random.default_rng(2).uniform(-1.3, 1.3, (3, 20_000))
    depth = 1.2 - np.linalg.norm(points, axis=0)
    np.testing.assert_array_equal(reference(root)(*points) < 0, (depth > 0) & (depth % 0.3 < 0.1))
    distance_kept(onion(box(size=(2, 1.5, 1)), period=0.3, thickness="0.1+0.05*z"))
    hollow = onion(mandelbulb(iterations=4), period=0.1, thickness=0.03)
    inside = reference(mandelbulb(iterations=4))(*points) < 0
    assert inside.any() and (reference(hollow.conservative())(*points)[inside] <= 0).all()


def test_several_fillers_are_united() -> None:
    ball, one, other = sphere(), gyroid(), schwarz_p()
    assert infill(ball, one, other, shell=0.1) == infill(ball, one | other, shell=0.1)


def test_a_fractal_is_filled() -> None:
    """Its field bounds nothing inside: the conservative one skips nothing there."""
    root = infill(mandelbulb(iterations=4), gyroid(period=0.4, volume_fraction=0.4), shell=0.05)
    points = np.random.default_rng(2).uniform(-1, 1, (3, 5000))
    inside = reference(mandelbulb(iterations=4))(*points) < 0
    assert inside.any() and (reference(root.conservative())(*points)[inside] <= 0).all()
    assert make_mesh(root, resolution=97).is_watertight


SCENE = '<scene version="1"><solid size="20mm">\n{}</solid></scene>'


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (
            '<infill shell="0.1"><sphere/></infill>',
            ":2: <infill> takes at least 2 elements inside it, found 1",
        ),
        ('<infill shell="0"><sphere/><gyroid/></infill>', "shell='0': expected a number > 0"),
        ("<infill><sphere/><gyroid/></infill>", "needs the attribute shell"),
        ('<gyroid volume_fraction="1"/>', "volume_fraction='1': expected a number > 0 and < 1"),
        (
            '<gyroid volume_fraction="0.2" thickness="0.3" period="2"/>',
            "period, thickness and volume_fraction: expected two of them, as the third follows",
        ),
        (
            '<gyroid volume_fraction="0.2" thickness="0.3+0.1*z"/>',
            "thickness and volume_fraction: expected one number with the other",
        ),
        (
            '<infill shell="0.1" denser="0.2"><mandelbulb/><gyroid/></infill>',
            "denser: expected elements with distances on both sides, and no fractals",
        ),
        (
            '<thicken by="0.1"><gyroid/></thicken>',
            ":2: <thicken> takes at least 2 elements inside it, found 1",
        ),
        ('<onion period="1" thickness="1"><box/></onion>', "thickness=1: expected less than period=1"),
        ('<thicken by="1"><gyroid/><mandelbulb/></thicken>', "<thicken> expected elements with distances"),
    ],
)
def test_errors_are_one_line(text: str, error: str) -> None:
    with pytest.raises(SceneError) as caught:
        reads(SCENE.format(text))
    assert error in str(caught.value).replace('"', "'") and "\n" not in str(caught.value)
