"""Every registered formula at least once, for the suites that are stamped on all of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import reduce
from pathlib import Path
from typing import Any
from unittest.mock import patch

import matplotlib
import pytest

from fracslice.common.parameters import Number
from fracslice.fields import linker
from fracslice.fields.definitions import Definition, formula
from fracslice.fields.linker import Linked
from fracslice.formulas import (
    Formula,
    Node,
    abox,
    amazing_surf,
    apollonian,
    beams,
    bend,
    benesi,
    bounds,
    box,
    bristorbrot,
    burning_ship,
    capsule,
    cells,
    cone,
    cosine_bulb,
    cylinder,
    difference,
    displace,
    extrude,
    fischer_koch_s,
    flake,
    frd,
    gear,
    gyroid,
    heightmap,
    hilbert,
    honeycomb,
    infill,
    intersection,
    iwp,
    jerusalem,
    julia,
    kifs_dodecahedron,
    kifs_icosahedron,
    kifs_octahedron,
    kifs_tetrahedron,
    koch,
    lambda_bulb,
    lidinoid,
    lithophane,
    mandelbox,
    mandelbulb,
    material,
    menger,
    mirror,
    model,
    neovius,
    noise,
    octahedron,
    offset,
    onion,
    orbit,
    plane,
    preimage,
    prism,
    pseudo_kleinian,
    quaternion_mandelbrot,
    quaternion_power,
    relief,
    repeat,
    revolve,
    scaffold,
    schwarz_d,
    schwarz_p,
    shell,
    sphere,
    split_p,
    struts,
    superquadric,
    sweep,
    tetrabrot,
    text,
    thicken,
    thread,
    torus,
    transform,
    tree,
    twist,
    union,
    volume,
    voronoi,
)


def cut(endless: Node) -> Node:
    """What has no end, in a box."""
    return bounds(endless, min=(-0.8, -0.7, -0.9), max=(0.8, 0.7, 0.9))


WALLS: tuple[Formula, ...] = (
    gyroid,
    iwp,
    lidinoid,
    neovius,
    schwarz_d,
    schwarz_p,
    frd,
    fischer_koch_s,
    split_p,
)


BAR = box(size=(1.6, 0.3, 0.4))

BRACKET = str(Path(__file__).parent / "models" / "bracket.stl")
"""A prism over an L, turned, of 0.576 cubic units and 20 triangles."""
GRID = str(Path(__file__).parent / "models" / "bracket.vdb")
"""The same, not turned, as distances at samples 0.1 apart, on its faces and between."""
WASHER = str(Path(__file__).parent / "models" / "washer.svg")
"""A square of 2 mm with a hole of a diamond of 0.5 square mm, in the middle."""
TRUSS = str(Path(__file__).parent / "models" / "truss.csv")
"""Six beams of a tetrahedron, and a ball."""
HILLS = str(Path(__file__).parent / "models" / "hills.png")
"""A picture of 16 x 9 pixels of 8 bits."""

FONT = str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf")

EXAMPLES: dict[str, Node] = {
    "sphere": sphere(radius=0.8),
    "box": box(size=(1.2, 0.8, 1.5)),
    "rounded box": box(size=(1.2, 0.8, 1.5), round=0.2),
    "torus": torus(radius=0.8, tube=0.3),
    "cylinder": cylinder(radius=0.6, height=1.4),
    "capsule": capsule(**{"from": (-0.5, 0, 0.2), "to": (0.4, 0.6, -0.1), "radius": 0.3}),
    "point capsule": capsule(**{"from": (0.1, 0, 0), "to": (0.1, 0, 0), "radius": 0.3}),
    "cone": cone(radius=0.7, height=1.2),
    "plane": plane(normal=(1, 2, -1), offset=0.2),
    "octahedron": octahedron(radius=1.1),
    "menger": menger(level=3),
    "julia": julia(iterations=10),
    "julia 4d": julia(iterations=8, c=(-0.2, 0.6, 0.1, 0.3)),
    "julia sphere": julia(iterations=7, c=(0, 0, 0, 0)),
    "mandelbulb": mandelbulb(iterations=6),
    "mandelbulb 2": mandelbulb(iterations=7, power=2),
    "mandelbulb 5": mandelbulb(iterations=5, power=5),
    "mandelbulb 7.5": mandelbulb(iterations=4, power=7.5),
    "mandelbulb in pieces": mandelbulb(iterations=3, power=6, julia=(0.9, -0.6, 0.5)),
    "mandelbulb julia": mandelbulb(iterations=6, julia=(0.3, 0.4, -0.5)),
    "tetrahedron flake": flake(solid="tetrahedron", level=3),
    "octahedron flake": flake(solid="octahedron", level=2),
    "dodecahedron flake": flake(solid="dodecahedron", level=1),
    "icosahedron flake": flake(level=2),
    "snowflake": cells(level=2),
    "cantor dust": cells(keep=(0,), level=2),
    "vicsek": cells(keep=(2, 3), level=2),
    "striped cells": cells(keep=(0, 2), level=2),
    "prism": prism(sides=5, radius=0.8, height=1.1),
    "superquadric": superquadric(size=(1.5, 1.2, 0.9), exponent=3.5),
    **{f"{wall.name} wall": cut(wall(period=0.9, thickness=0.12)) for wall in WALLS},
    "graded wall": cut(gyroid(period=0.9, thickness=0.12, grade=(0.2, 0, -0.05))),
    **{
        f"{kind} struts": cut(struts(kind=kind, period=0.9, thickness=0.2))
        for kind in ("bcc", "kelvin", "octet")
    },
    "foam": cut(voronoi(period=0.7)),
    "foam of walls": cut(voronoi(kind="walls", period=0.7, seed=5)),
    "jerusalem": jerusalem(level=2),
    "koch": koch(level=3),
    "hilbert": hilbert(level=2),
    "tree": tree(level=3),
    "gear": gear(teeth=12),
    "thread": thread(radius=0.6, pitch=0.3),
    "apollonian": apollonian(level=3),
    "model": model(BRACKET),
    "volume": volume(GRID),
    "extrude": extrude(WASHER, size=1.4, height=0.6),
    "text": text("o8", FONT, depth=0.4),
    "revolve": revolve(WASHER, size=0.6, offset=0.4),
    "sweep": sweep(WASHER, size=0.4, points="-0.7 -0.6 0, 0.7 -0.5 0.1, 0.2 0.7 0", closed="yes"),
    "beams": beams(TRUSS, thickness=0.15, smooth=0.2),
    "preimage": preimage(mandelbox(scale=-1.5, iterations=2), sphere(radius=4), of="every"),
    "scaffold": scaffold(box(size=(1.2, 0.9, 1.0)), count=12, thickness=0.2),
    "scaffold on a surface": scaffold(
        sphere(0.8), of="delaunay", where="surface", count=12, thickness=0.2, smooth=0.1
    ),
    "heightmap": heightmap(HILLS, size=1.5, height=0.4, base=0.1),
    "lithophane": lithophane(HILLS, thinnest=0.1, thickest=0.3),
    "lithophane wall": lithophane(HILLS, form="cylinder", thinnest=0.1, thickest=0.3, degrees=200),
    "lithophane ball": lithophane(HILLS, form="sphere", thinnest=0.1, thickest=0.3),
    "relief": relief(sphere(radius=0.7), file=HILLS, height=0.2),
    "honeycomb": honeycomb(thickness=0.3, reach=0.9),
    "pseudo kleinian": cut(pseudo_kleinian(steps=5)),
    "tetrabrot": tetrabrot(iterations=7),
    "mandelbox": mandelbox(iterations=5),
    "mandelbox -1.5": mandelbox(scale=-1.5, iterations=7, julia=(1, 0.5, -0.3)),
    "abox": abox(iterations=5, size=(1, 0.8, 1e6), angle=20),
    "quaternion mandelbrot": quaternion_mandelbrot(iterations=7),
    "bristorbrot": bristorbrot(iterations=6),
    "bristorbrot julia": bristorbrot(iterations=6, julia=(-0.4, 0.3, 0.2)),
    "burning ship": burning_ship(iterations=4),
    "hybrid": orbit(mandelbulb(repeat=2), mandelbox(scale=-1.5), iterations=2),
    "hybrid transformed": orbit(
        mandelbox(scale=-1.5),
        transform(mandelbulb(3), rotate=(0, 0, 1, 30), translate=(0.1, 0, 0), scale=(1.1, 1, 1)),
        julia(c=(0.1, 0.2, 0, 0)),
        iterations=3,
    ),
    "amazing surf": amazing_surf(scale=2.0, iterations=6),
    "kaleidoscopic tetrahedron": kifs_tetrahedron(iterations=4, angle=20),
    "kaleidoscopic octahedron": kifs_octahedron(iterations=4, angle=15),
    "kaleidoscopic dodecahedron": kifs_dodecahedron(iterations=3, angle=10),
    "kaleidoscopic icosahedron": kifs_icosahedron(iterations=3, angle=12),
    "quaternion cube": quaternion_power(iterations=6),
    "quaternion julia 4": quaternion_power(power=4, iterations=5, julia=(-0.2, 0.6, 0.2)),
    "cosine bulb": cosine_bulb(iterations=4),
    "lambda bulb": lambda_bulb(iterations=5),
    "benesi": benesi(iterations=5),
    "union": union(sphere(radius=0.7), BAR, torus(radius=0.9, tube=0.1)),
    "smooth union": union(sphere(radius=0.7), BAR, smooth=0.2),
    "intersection": intersection(sphere(radius=0.7), BAR),
    "smooth intersection": intersection(sphere(radius=0.7), box(), smooth=0.1),
    "difference": difference(box(), sphere(radius=0.6), BAR),
    "smooth difference": difference(box(), sphere(radius=0.6), smooth=0.1),
    "offset": offset(box(), distance=0.15),
    "displace": displace(box(), by="0.1*sin(4*x)*sin(4*y)"),
    "thicken": thicken(cut(gyroid(period=0.9, thickness=0.05)), sphere(0.3), by=0.2, within=0.4),
    "onion": onion(box(size=(1.6, 1.4, 1.2)), period=0.25, thickness=0.1),
    "shell": shell(sphere(), thickness=0.1),
    "denser infill": infill(sphere(), gyroid(period=0.9, thickness=0.05), shell=0.1, denser=0.2, within=0.5),
    "infill": infill(sphere(), gyroid(period=0.9, thickness=0.12), shell=0.1),
    "perlin noise": noise(sphere(), kind="perlin"),
    "simplex noise": noise(BAR, octaves=2),
    "moved": transform(box(), translate=(0.3, -0.2, 0.1)),
    "transform": transform(torus(), translate=(0.2, 0, 0), rotate=(1, 1, 0, 40), scale=(0.5, 0.9, 0.7)),
    "matrix": transform(box(), matrix=(1, 0.3, 0, 0, 0, 1, 0, 0.1, 0, 0, 0.8, 0)),
    "mirror": mirror(transform(sphere(radius=0.5), translate=(0.3, 0.2, 0)), axis="x"),
    "repeat": repeat(sphere(radius=0.2), period=(0.5, 0.5, 0.5), count=(3, 3, 1)),
    "repeat overlapping": repeat(sphere(radius=0.5), period=(0.6, 0.8, 3.0), count=(4, 2, 1)),
    "endless repeat": bounds(
        repeat(torus(radius=0.12, tube=0.04), period=(0.4, 0.4, 0.4)), min=(-1, -1, -1), max=(1, 0.9, 0.8)
    ),
    "bounds": bounds(plane(), min=(-0.5, -0.6, -0.7), max=(0.8, 0.9, 1.0)),
    "twist": twist(transform(BAR, rotate=(0, 1, 0, 90)), degrees=100),
    "twist x": twist(BAR, axis="x", degrees=-80),
    "bend": bend(BAR, degrees=70),
    "bend y": bend(transform(BAR, rotate=(0, 1, 0, 90)), axis="y", degrees=-50),
    "material": material(torus(), colour=(0.9, 0.2, 0.1), reflect=0.3),
    "many": difference(
        box(size=(1.8, 1.6, 1.4)),
        *(
            transform(sphere(radius=0.1 + 0.02 * k), translate=(0.2 * k - 0.8, 0.1 * k, 0.7))
            for k in range(7)
        ),
        *(transform(BAR, rotate=(1, k, 0, 20 * k), scale=0.5) for k in range(1, 6)),
    ),
    "deep": reduce(
        lambda inner, k: bounds(inner, min=(-1.5 + 0.02 * k, -1.4, -1.3), max=(1.4, 1.3, 1.2 - 0.02 * k)),
        range(16),
        sphere(radius=1.2),
    ),
    "example of the documentation": union(
        mandelbulb(power=8, iterations=4),
        transform(menger(level=3), translate=(0, 0, -1.1), rotate=(1, 0, 0, 90), scale=0.4),
        repeat(sphere(radius=0.2), period=(0.5, 0.5, 0.5), count=(3, 3, 1)),
        smooth=0.05,
    ),
}

OF_FILES = {
    "beams", "scaffold", "scaffold on a surface",
    "model", "extrude", "revolve", "sweep", "text", "volume", "heightmap", "lithophane", "lithophane wall",
    "lithophane ball", "relief",
}  # fmt: skip
"""Examples that native code computes, on the CPU alone; each shape is of a file."""

_TURNED = "return scale * turn(fold(w, 1), (0, 0, 1), 20) + c"
_EGG = "return sqrt(x**2 + y**2 + (flat * z)**2) - 1"
DEFINED = {
    "a step": formula(Definition("own", (("scale", Number(-1.7, "")),), _TURNED))(iterations=3),
    "a distance": formula(Definition("egg", (("flat", Number(0.7, "")),), _EGG, "distance"))(),
}
"""Formulas as a scene defines them; they are not registered."""

REPRESENTATIVES = {
    "beams", "scaffold",
    "a distance", "a step", "abox", "apollonian", "bend", "bounds", "bristorbrot julia", "burning ship",
    "cone", "cosine bulb", "deep", "difference", "extrude", "foam of walls", "gear", "gyroid wall",
    "heightmap", "honeycomb",
    "hybrid transformed", "julia 4d", "kaleidoscopic octahedron", "kelvin struts", "koch",
    "lambda bulb", "lithophane wall", "mandelbox -1.5", "mandelbulb", "mandelbulb 7.5", "many", "material",
    "menger", "mirror", "model", "octahedron flake", "perlin noise", "preimage", "prism",
    "pseudo kleinian",
    "quaternion julia 4", "repeat overlapping", "revolve", "rounded box", "schwarz_d wall", "shell",
    "smooth intersection", "smooth union", "snowflake", "sphere", "superquadric", "sweep", "text", "thread",
    "transform", "tree", "twist x", "volume",
}  # fmt: skip
"""Examples of which none is built like another; tests that are stamped on all have the others in a night."""

STRUCTURES = {
    "a step", "bend", "deep", "difference", "gyroid wall", "hybrid transformed", "julia 4d", "koch",
    "mandelbox -1.5", "mandelbulb 7.5", "menger", "octahedron flake", "perlin noise", "repeat overlapping",
    "smooth union", "sphere", "transform",
}  # fmt: skip
"""The few of them for tests that compile or mesh each: a loop, a tree, a fold, a lattice, a seam, a sum."""


def stamped(cases: Iterable[Any], often: Collection[Any] = REPRESENTATIVES) -> list[Any]:
    """Cases of a test: those of `often` in every run, the others in `make nightly`."""
    values = ((case, case if isinstance(case, tuple) else (case,)) for case in cases)
    return [case if case in often else pytest.param(*of, marks=pytest.mark.nightly) for case, of in values]


def link_whole(root: Node) -> Linked:
    """Link a scene whose long unions ask all elements."""
    with patch.object(linker, "is_long", return_value=False):
        linked = linker.link(root)
    assert not linked.regions
    return linked
