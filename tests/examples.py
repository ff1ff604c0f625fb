"""Every registered formula at least once, for the suites that are stamped on all of them."""

from __future__ import annotations

from functools import reduce

from fracslice.formulas import (
    Formula,
    Node,
    abox,
    bend,
    bounds,
    box,
    bristorbrot,
    burning_ship,
    capsule,
    cells,
    cone,
    cylinder,
    difference,
    flake,
    gyroid,
    intersection,
    iwp,
    julia,
    lidinoid,
    mandelbox,
    mandelbulb,
    material,
    menger,
    mirror,
    neovius,
    octahedron,
    offset,
    plane,
    prism,
    quaternion_mandelbrot,
    repeat,
    schwarz_d,
    schwarz_p,
    shell,
    sphere,
    superquadric,
    torus,
    transform,
    twist,
    union,
)


def walled(wall: Formula) -> Node:
    """A wall without end in a ball."""
    return bounds(wall(period=0.9, thickness=0.12), min=(-0.8, -0.7, -0.9), max=(0.8, 0.7, 0.9))


BAR = box(size=(1.6, 0.3, 0.4))

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
    **{f"{wall.name} wall": walled(wall) for wall in (gyroid, iwp, lidinoid, neovius, schwarz_d, schwarz_p)},
    "mandelbox": mandelbox(iterations=5),
    "mandelbox -1.5": mandelbox(scale=-1.5, iterations=7, julia=(1, 0.5, -0.3)),
    "abox": abox(iterations=5, size=(1, 0.8, 1e6), angle=20),
    "quaternion mandelbrot": quaternion_mandelbrot(iterations=7),
    "bristorbrot": bristorbrot(iterations=6),
    "bristorbrot julia": bristorbrot(iterations=6, julia=(-0.4, 0.3, 0.2)),
    "burning ship": burning_ship(iterations=4),
    "union": union(sphere(radius=0.7), BAR, torus(radius=0.9, tube=0.1)),
    "smooth union": union(sphere(radius=0.7), BAR, smooth=0.2),
    "intersection": intersection(sphere(radius=0.7), BAR),
    "smooth intersection": intersection(sphere(radius=0.7), box(), smooth=0.1),
    "difference": difference(box(), sphere(radius=0.6), BAR),
    "smooth difference": difference(box(), sphere(radius=0.6), smooth=0.1),
    "offset": offset(box(), distance=0.15),
    "shell": shell(sphere(), thickness=0.1),
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
