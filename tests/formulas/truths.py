"""What is known of every formula from outside: symmetries, periods, volumes, and solids known otherwise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, radians, sin, sqrt

import numpy as np
from PIL import Image
from scipy.ndimage import map_coordinates

from fracslice import formulas as f
from fracslice.fields.devices import reference
from fracslice.fields.orbits import growth_of
from fracslice.formulas import Node
from fracslice.formulas.bulbs import DIAGONAL, DIAGONAL_AXIS
from tests.examples import EXAMPLES, HILLS

Field = Callable[..., np.ndarray]
Matrix = np.ndarray

X, Y, Z, DIAGONALLY = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)


def rotation(axis: tuple[float, ...], degrees: float) -> Matrix:
    """Rodrigues' formula."""
    u, angle = np.array(axis) / np.linalg.norm(axis), radians(degrees)
    cross = np.cross(np.eye(3), u)
    return cos(angle) * np.eye(3) + (1 - cos(angle)) * np.outer(u, u) + sin(angle) * cross


def reflection(normal: tuple[float, ...]) -> Matrix:
    u = np.array(normal) / np.linalg.norm(normal)
    return np.eye(3) - 2 * np.outer(u, u)


FLIP, FLIP_Y, FLIP_Z, SWAP = (reflection(n) for n in (X, Y, Z, (1, -1, 0)))
TURN, HALF_TURN, INVERSE = rotation(DIAGONALLY, 120), rotation(Z, 180), -np.eye(3)
TETRAHEDRAL, OCTAHEDRAL, PYRITOHEDRAL = (TURN, SWAP, HALF_TURN), (TURN, SWAP, FLIP), (TURN, FLIP)
PLANE = np.diag([1.0, 1.0, 0.0])
"""Projection along z: what is known in a plane."""


@dataclass(frozen=True)
class Equal:
    """A field equals another one, where `at` takes its points; with `sign`, the solids are equal."""

    root: Node
    other: Node | Field
    at: Matrix | tuple[float, float, float] = (0.0, 0.0, 0.0)
    sign: bool = False

    @property
    def kind(self) -> str:
        if self.root is not self.other:
            return "closed form"
        return "symmetry" if isinstance(self.at, np.ndarray) else "period"

    def verify(self, rng: np.random.Generator) -> None:
        box = self.root.bounds.box
        far = 1.1 * max(box.size) / 2 if box.finite else 1.3
        p = rng.uniform(-far, far, (3, 3000))
        moved = self.at @ p if isinstance(self.at, np.ndarray) else p + np.array(self.at)[:, None]
        other = reference(self.other) if isinstance(self.other, Node) else self.other
        values, known = reference(self.root)(*moved), other(*p)
        if self.sign:
            assert 20 < (values < 0).sum() < 3000
            np.testing.assert_array_equal(values < 0, known < 0)
        else:
            np.testing.assert_allclose(values, known, rtol=1e-9, atol=1e-9)


@dataclass(frozen=True)
class Volume:
    """The volume of a solid, or of the share of an endless one in the cube [0, 1]^3."""

    root: Node
    volume: float
    kind = "volume"

    def verify(self, rng: np.random.Generator) -> None:
        """By random points, within four standard deviations."""
        box, count = self.root.bounds.box, 100_000
        lo, hi = (box.lo, box.hi) if box.finite else ((0, 0, 0), (1, 1, 1))
        whole = float(np.prod(np.subtract(hi, lo)))
        share = float((reference(self.root)(*rng.uniform(lo, hi, (count, 3)).T) < 0).mean())
        assert abs(share * whole - self.volume) < 4 * whole * sqrt(share * (1 - share) / count) + 1e-12


Truth = Equal | Volume


def symmetric(root: Node, *symmetries: Matrix) -> list[Truth]:
    return [Equal(root, root, symmetry) for symmetry in symmetries]


def periodic(root: Node, *periods: tuple[float, float, float]) -> list[Truth]:
    return [Equal(root, root, period) for period in periods]


def ball(root: Node, power: int) -> Truth:
    """With the constant 0, |w| becomes |w|^n in every step: a ball."""
    radius = growth_of(root).escape ** (1 / power ** root["iterations"])
    return Equal(root, f.sphere(radius=radius), sign=True)


def of_squares(root: Node, constant: complex | None = None) -> Truth:
    """In the plane z = 0, the Mandelbrot set, or a Julia set, of z^2 + c."""
    iterations, escape = root["iterations"], growth_of(root).escape

    def plane(x: np.ndarray, y: np.ndarray, _: np.ndarray) -> np.ndarray:
        w, gone = x + 1j * y, np.zeros(len(x), bool)
        c = w if constant is None else constant
        for _ in range(iterations):
            w = np.where(gone, w, w * w + c)
            gone |= abs(w) > escape
        return np.where(gone, 1.0, -1.0)

    return Equal(root, plane, PLANE, sign=True)


def tetrabrot(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Two complex Mandelbrot sets of 9 steps."""
    inside = np.ones(len(x), bool)
    for c in (x + 1j * (y - z), x + 1j * (y + z)):
        w = c
        for _ in range(9):
            w = np.where(abs(w) < 1e6, w * w + c, w)
        inside &= abs(w) <= 2
    return np.where(inside, -1.0, 1.0)


def pine_tree(*points: np.ndarray) -> np.ndarray:
    """The transform T1, with scale 2 and offset 2, and the pine tree with the constant (x, 0, 0), as in
    Mandelbulber: 2 steps.
    """
    s, t, u = sqrt(1 / 3), sqrt(1 / 2), sqrt(1 / 6)
    frame, inside = np.array([[s, -t, -u], [s, t, -u], [s, 0, 2 * u]]), np.ones(len(points[0]), bool)
    w, escape = np.array(points), growth_of(f.benesi(iterations=2)).escape
    for _ in range(2):
        x, y, z = frame.T @ (2 * np.abs(frame @ w)) - [[2], [0], [0]]
        double, square = 2 * x / np.maximum(np.hypot(y, z), 1e-30), y * y + z * z
        image = np.array([x * x - square + points[0], 2 * double * y * z, double * (y * y - z * z)])
        w = np.where(inside, image, w)
        inside &= np.linalg.norm(w, axis=0) < escape
    return np.where(inside, -1.0, 1.0)


def tube(level: int) -> float:
    """Volume along a Hilbert curve whose radius is a quarter of its edges: cylinders, quarters of a ball for
    the quarters of a Steinmetz solid at its bends, and half a ball at each end.
    """
    edge = 2.0 ** (1 - level)
    return edge**3 * (pi / 16 * (8**level - 1) + (BENDS[level] * (pi - 4) / 3 + 4 / 3 * pi) / 64)


BENDS = {1: 6, 2: 59}


def both(combined: Callable[..., np.ndarray], *roots: Node) -> Field:
    return lambda *p: combined(*(reference(root)(*p) for root in roots))


ORIGIN = (0.0, 0.0, 0.0)
GOLDEN, CUBE = (1 + sqrt(5)) / 2, (sqrt(2) - 1) ** 3
CORE = 0.5 - 5 / 16 * sqrt(3) * 0.3
FLANK = (0.25 + 0.5 * CORE + CORE**2) / 3
"""Radius of the thread's roots, and mean square of the radius along a flank."""
BALL, CUBOID = f.sphere(radius=0.7), f.box(size=(1.6, 0.3, 0.4))
HALF = 0.5
SOLIDS = {
    "tetrahedron": (2, 8 / (9 * sqrt(3)) / 4),
    "octahedron": (2, 4 / 3 * (3 / 4) ** 2),
    "dodecahedron": (1, 2.785163863 * 20 / (2 + GOLDEN) ** 3),
    "icosahedron": (2, 2.536150710 * (12 / (1 + GOLDEN) ** 3) ** 2),
}
GROUPS = {
    "tetrahedron": TETRAHEDRAL,
    "octahedron": OCTAHEDRAL,
    "dodecahedron": PYRITOHEDRAL,
    "icosahedron": PYRITOHEDRAL,
}
FRAME = rotation(DIAGONAL_AXIS, DIAGONAL)
"""The frame in which a step of `benesi` folds space."""

BRACKET = f.model(EXAMPLES["model"]["file"])
"""A prism over an L, of two boxes."""
L_SHAPE = f.union(
    f.transform(f.box((1.2, 0.5, 0.6)), translate=(0.1, -0.35, 0)),
    f.transform(f.box((0.4, 1.4, 0.6)), translate=(-0.3, 0.1, 0)),
)

WASHER = EXAMPLES["extrude"]
HOLED = f.difference(
    f.box((1.4, 1.4, 0.6)), f.transform(f.box((0.35 * sqrt(2), 0.35 * sqrt(2), 1)), rotate=(0, 0, 1, 45))
)
"""The same of two boxes."""

PIXELS = np.asarray(Image.open(HILLS), float)[::-1] / 255


def level(x: np.ndarray, y: np.ndarray, size: float) -> np.ndarray:
    """Level of a picture whose longest side has a size, bilinear between its pixels."""
    rows, columns = PIXELS.shape
    at = [np.clip(a * (columns - 1) / size + (n - 1) / 2, 0, n - 1) for a, n in ((y, rows), (x, columns))]
    return np.asarray(map_coordinates(PIXELS, at, order=1, mode="nearest"))


def plate(root: Node, black: float, white: float) -> Truth:
    """What is below a picture."""
    box, size = root.bounds.box, root["size"]

    def field(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        inside = (abs(x) < box.hi[0]) & (abs(y) < box.hi[1]) & (z > box.lo[2])
        below = z - box.lo[2] < black + (white - black) * level(x, y, size)
        return np.where(inside & below, -1.0, 1.0)

    return Equal(root, field, sign=True)


def raised(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.sqrt(x * x + y * y + z * z) - 0.7 - 0.2 * level(x, y, 1.0)


BOX_ORBIT = f.mandelbox(scale=-1.5, iterations=2)

TRUTHS: dict[str, list[Truth]] = {
    "beams": [
        Equal(
            EXAMPLES["beams"].changed(smooth=0, size=3, thickness=0.45 / 1.4),
            f.transform(EXAMPLES["beams"].changed(smooth=0), scale=3 / 1.4),
            sign=True,
        )
    ],
    "preimage": [
        Equal(f.preimage(BOX_ORBIT, f.sphere(radius=growth_of(BOX_ORBIT).surface)), BOX_ORBIT, sign=True)
    ],
    "scaffold": [
        Equal(
            EXAMPLES["scaffold"],
            f.intersection(EXAMPLES["scaffold"], EXAMPLES["scaffold"].children[0]),
        )
    ],
    "heightmap": [plate(EXAMPLES["heightmap"], 0.1, 0.5)],
    "lithophane": [plate(EXAMPLES["lithophane"], 0.3, 0.1)],
    "infill": [
        Equal(
            f.infill(BALL, f.gyroid(), shell=0.1),
            f.union(f.shell(BALL, thickness=0.1), f.intersection(BALL, f.gyroid())),
        )
    ],
    "displace": [Equal(f.displace(BALL, by=0.1), f.offset(BALL, distance=0.1))],
    "onion": [
        Equal(
            f.onion(f.sphere(0.7), period=0.3, thickness=0.1),
            f.union(
                f.shell(f.sphere(0.7), thickness=0.1), f.shell(f.sphere(0.4), thickness=0.1), f.sphere(0.1)
            ),
            sign=True,
        )
    ],
    "thicken": [Equal(f.thicken(BALL, BALL, by=0.2, within=0.5), f.sphere(0.7 + 1 / 12), sign=True)],
    "relief": [Equal(EXAMPLES["relief"], raised, sign=True)],
    "revolve": [Volume(EXAMPLES["revolve"], 2 * pi * 0.7 * 0.6**2 * (1 - 0.5 / 4))],
    "sweep": [
        Equal(
            f.sweep(WASHER["file"], size=1.4, points="0 0 -0.3, 0 0 0.3"),
            f.extrude(WASHER["file"], size=1.4, height=0.6),
        )
    ],
    "text": [Equal(EXAMPLES["text"].changed(size=2, depth=0.8), f.transform(EXAMPLES["text"], scale=2))],
    "extrude": [Volume(WASHER, 1.4**2 * (1 - 0.5 / 4) * 0.6), Equal(WASHER, HOLED, sign=True)],
    "volume": [Equal(EXAMPLES["volume"], L_SHAPE, sign=True)],
    "model": [Volume(BRACKET, 0.576), Equal(BRACKET, L_SHAPE, rotation(X, 20) @ rotation(Z, 35), sign=True)],
    "sphere": [Equal(BALL, lambda *p: np.linalg.norm(p, axis=0) - 0.7), Volume(BALL, 4 / 3 * pi * 0.343)],
    "box": [
        Volume(CUBOID, 0.192),
        Equal(f.box(size=(1, 1, 1), round=0.5), f.sphere(radius=0.5)),
        *symmetric(f.box(), *OCTAHEDRAL),
    ],
    "torus": [Volume(f.torus(radius=0.8, tube=0.3), 2 * pi**2 * 0.8 * 0.09)],
    "cylinder": [Volume(f.cylinder(radius=0.6, height=1.4), pi * 0.36 * 1.4)],
    "capsule": [
        Volume(f.capsule(from_=(0, 0, 0), to=(0, 1, 0), radius=0.3), pi * 0.09 * (1 + 0.4)),
        Equal(f.capsule(from_=ORIGIN, to=ORIGIN, radius=0.3), f.sphere(radius=0.3)),
    ],
    "cone": [Volume(f.cone(radius=0.7, height=1.2), pi * 0.49 * 1.2 / 3)],
    "plane": [
        Equal(f.plane(normal=(1, 2, -2), offset=0.2), lambda x, y, z: (x + 2 * y - 2 * z) / 3 - 0.2),
    ],
    "octahedron": [Volume(f.octahedron(radius=1.1), 4 / 3 * 1.331), *symmetric(f.octahedron(), *OCTAHEDRAL)],
    "prism": [
        Volume(f.prism(sides=5, radius=1, height=0.5), 2.5 * sin(2 * pi / 5) * 0.5),
        *symmetric(f.prism(sides=5), rotation(Z, 72), FLIP_Y, FLIP_Z),
    ],
    "superquadric": [
        Volume(f.superquadric(size=(1, 2, 0.5), exponent=2), pi / 6),
        Equal(f.superquadric(exponent=2), f.sphere(radius=0.5)),
        *symmetric(f.superquadric(), *OCTAHEDRAL),
    ],
    "gear": symmetric(f.gear(teeth=7), rotation(Z, 360 / 7), FLIP_Y, FLIP_Z),
    "thread": [
        Volume(
            f.thread(radius=0.5, pitch=0.3, height=0.9),
            0.9 * pi * (0.125 * 0.25 + 0.25 * CORE**2 + 0.625 * FLANK),
        )
    ],
    "menger": [Volume(f.menger(level=2), 8 * (20 / 27) ** 2), *symmetric(f.menger(level=2), *OCTAHEDRAL)],
    "cells": [
        *(
            Volume(f.cells(keep=keep, level=2), 8 * (count / 27) ** 2)
            for keep, count in (((0,), 8), ((2, 3), 7), ((1, 2), 18), ((0, 2), 14))
        ),
        Equal(f.cells(keep=(0, 1), level=3), f.menger(level=3), sign=True),
        *symmetric(f.cells(keep=(1, 3)), *OCTAHEDRAL),
    ],
    "jerusalem": [
        Volume(f.jerusalem(level=1), 8 * (8 * CUBE + 12 * CUBE**2)),
        Volume(f.jerusalem(level=2), 8 * (8 * CUBE * (8 * CUBE + 12 * CUBE**2) + 12 * CUBE**2)),
        *symmetric(f.jerusalem(level=2), *OCTAHEDRAL),
    ],
    "flake": [
        *(Volume(f.flake(solid=s, level=level), volume) for s, (level, volume) in SOLIDS.items()),
        *(truth for s, group in GROUPS.items() for truth in symmetric(f.flake(solid=s, level=2), *group)),
        Equal(f.flake(solid="octahedron", level=0), f.octahedron(), sign=True),
    ],
    "koch": [
        Volume(f.koch(level=3, height=0.5), 0.5 * 3 * sqrt(3) / 4 * (1 + 0.6 * (1 - (4 / 9) ** 3))),
        Equal(f.koch(level=0), f.prism(sides=3, radius=1, height=0.5)),
        *symmetric(f.koch(), rotation(Z, 60), FLIP_Y, FLIP_Z),
    ],
    "hilbert": [
        *(Volume(f.hilbert(level=level), tube(level)) for level in (1, 2)),
        *symmetric(f.hilbert(level=1), FLIP),
    ],
    "tree": [
        Equal(f.tree(level=0), f.capsule(from_=ORIGIN, to=Z, radius=0.1)),
        *symmetric(f.tree(branches=5), rotation(Z, 72), FLIP_Y),
    ],
    **{
        name: [
            *symmetric(f.get(name)(), *group),
            *periodic(f.get(name)(), (1, 0, 0), (0, HALF, HALF) if name == "frd" else (HALF,) * 3),
        ]
        for name, group in {
            "gyroid": (TURN, INVERSE),
            "schwarz_p": OCTAHEDRAL,
            "schwarz_d": (TURN, INVERSE),
            "neovius": OCTAHEDRAL,
            "iwp": OCTAHEDRAL,
            "lidinoid": (TURN, INVERSE),
            "frd": OCTAHEDRAL,
            "fischer_koch_s": (TURN, INVERSE),
            "split_p": (TURN, INVERSE),
        }.items()
    },
    "struts": [
        *(
            truth
            for kind in ("cubic", "bcc", "fcc", "octet", "kelvin")
            for truth in [
                *symmetric(f.struts(kind=kind), *OCTAHEDRAL),
                *periodic(f.struts(kind=kind), (1, 0, 0)),
            ]
        ),
        # Three cylinders that cross in a Steinmetz solid.
        Volume(f.struts(kind="cubic", thickness=0.4), 3 * pi * 0.04 - 8 * sqrt(2) * 0.008),
    ],
    "voronoi": [
        *periodic(f.voronoi(), (289, 0, 0), (0, -289, 0)),
        *periodic(f.voronoi(irregularity=0.0), X),
        *symmetric(f.voronoi(irregularity=0.0), *OCTAHEDRAL),
    ],
    "apollonian": [
        Volume(f.apollonian(level=0, swell=1.0), 4 * 4 / 3 * pi * (sqrt(6) - 2) ** 3),
        Volume(f.apollonian(level=1, swell=1.0), 8 * 0.2418),
        *symmetric(f.apollonian(level=0), *TETRAHEDRAL),
        *symmetric(f.apollonian(level=3), *TETRAHEDRAL),
    ],
    "pseudo_kleinian": symmetric(f.pseudo_kleinian(steps=3), FLIP, FLIP_Y, FLIP_Z),
    "honeycomb": [
        *(truth for kind in ("534", "353") for truth in symmetric(f.honeycomb(kind=kind), FLIP, INVERSE)),
        *symmetric(f.honeycomb(kind="435"), *OCTAHEDRAL),
    ],
    "julia": [
        Equal(f.julia(c=(0, 0, 0, 0), iterations=3), f.sphere(radius=2 ** (1 / 8)), sign=True),
        *symmetric(f.julia(iterations=5), INVERSE, FLIP_Z),
        *symmetric(f.julia(iterations=5, c=(-0.7, 0, 0, 0)), rotation(X, 37)),
    ],
    "tetrabrot": [
        Equal(f.tetrabrot(iterations=9), tetrabrot, sign=True),
        *symmetric(f.tetrabrot(iterations=6), FLIP_Y, FLIP_Z),
    ],
    "quaternion_mandelbrot": [
        of_squares(f.quaternion_mandelbrot(iterations=6)),
        ball(f.quaternion_mandelbrot(iterations=3, julia=ORIGIN), 2),
        *symmetric(f.quaternion_mandelbrot(iterations=6), rotation(X, 37), FLIP_Z),
    ],
    "quaternion_power": [
        Equal(f.quaternion_power(power=2, iterations=5), f.quaternion_mandelbrot(iterations=5)),
        ball(f.quaternion_power(power=5, iterations=2, julia=ORIGIN), 5),
        *symmetric(f.quaternion_power(power=3, iterations=5), rotation(X, 37), FLIP),
    ],
    "mandelbulb": [
        ball(f.mandelbulb(power=3, iterations=2, julia=ORIGIN), 3),
        ball(f.mandelbulb(power=8, iterations=2, julia=ORIGIN), 8),
        *symmetric(f.mandelbulb(power=8, iterations=3), rotation(Z, 360 / 7), FLIP_Y),
        *symmetric(f.mandelbulb(power=5, iterations=3), rotation(Z, 90), FLIP_Z),
    ],
    "burning_ship": [
        ball(f.burning_ship(power=8, iterations=2, julia=ORIGIN), 8),
        *symmetric(f.burning_ship(iterations=2, julia=(0.3, 0.2, 0.1)), FLIP, FLIP_Y, FLIP_Z),
    ],
    "cosine_bulb": [
        ball(f.cosine_bulb(power=5, iterations=2, julia=ORIGIN), 5),
        *symmetric(f.cosine_bulb(power=5, iterations=3), rotation(Z, 90), FLIP_Y, FLIP_Z),
    ],
    "lambda_bulb": symmetric(f.lambda_bulb(power=5, iterations=3), rotation(Z, 90), FLIP_Z),
    "bristorbrot": [
        of_squares(f.bristorbrot(iterations=6)),
        of_squares(f.bristorbrot(iterations=6, julia=(-0.4, 0.5, 0)), -0.4 + 0.5j),
        *symmetric(f.bristorbrot(iterations=5), reflection((0, 1, 1))),
    ],
    "benesi": [
        Equal(f.benesi(iterations=2), pine_tree, sign=True),
        ball(f.benesi(scale=1, offset=0, iterations=3, julia=ORIGIN), 2),
        *symmetric(f.benesi(iterations=3, julia=(0.3, 0.2, 0.1)), *(reflection(row) for row in FRAME)),
    ],
    "mandelbox": [
        *symmetric(f.mandelbox(iterations=4), *OCTAHEDRAL),
        *symmetric(f.mandelbox(scale=-1.5, iterations=4), *OCTAHEDRAL),
    ],
    "abox": [
        Equal(f.abox(size=(1, 1, 1), iterations=4), f.mandelbox(iterations=4)),
        Equal(f.abox(size=(1, 1, 1e6), iterations=4), f.amazing_surf(iterations=4)),
        *symmetric(f.abox(size=(1, 1, 0.7), angle=20, iterations=4), rotation(Z, 90), FLIP_Z),
    ],
    "amazing_surf": symmetric(f.amazing_surf(iterations=4), SWAP, FLIP, FLIP_Z),
    **{
        f"kifs_{solid}": [
            *symmetric(f.get(f"kifs_{solid}")(iterations=3), *group),
            *symmetric(f.get(f"kifs_{solid}")(iterations=3, angle=20), group[-1]),
        ]
        for solid, group in GROUPS.items()
    },
    "orbit": [
        Equal(f.orbit(f.mandelbox(), iterations=3), f.mandelbox(iterations=3), sign=True),
        *symmetric(f.orbit(f.mandelbox(), f.mandelbulb(power=5), iterations=2), rotation(Z, 90), FLIP_Z),
    ],
    "union": [Equal(f.union(BALL, CUBOID), both(np.minimum, BALL, CUBOID))],
    "intersection": [Equal(f.intersection(BALL, CUBOID), both(np.maximum, BALL, CUBOID))],
    "difference": [
        Equal(f.difference(BALL, CUBOID), both(lambda a, b: np.maximum(a, -b), BALL, CUBOID)),
    ],
    "offset": [Equal(f.offset(BALL, distance=0.2), f.sphere(radius=0.9))],
    "shell": [Volume(f.shell(BALL, thickness=0.2), 4 / 3 * pi * (0.7**3 - 0.5**3))],
    "material": [Equal(f.material(CUBOID, colour=(1, 0, 0)), CUBOID)],
    "transform": [
        Equal(f.transform(BALL, translate=(0.1, 0.2, 0.3)), BALL, (0.1, 0.2, 0.3)),
        Equal(f.transform(CUBOID, rotate=(*DIAGONALLY, 50)), CUBOID, rotation(DIAGONALLY, 50)),
        Volume(f.transform(CUBOID, scale=(0.5, 2, 3)), 0.192 * 3),
    ],
    "mirror": symmetric(f.mirror(f.transform(CUBOID, rotate=(*DIAGONALLY, 50)), axis="x"), FLIP),
    "repeat": periodic(f.repeat(f.sphere(radius=0.2), period=(0.5, 0.7, 0.9)), (0.5, -0.7, 1.8)),
    "bounds": [
        Equal(f.bounds(BALL, min=(-0.5,) * 3, max=(0.5,) * 3), both(np.maximum, BALL, f.box()), sign=True),
    ],
    "twist": [
        Volume(f.twist(CUBOID, axis="x", degrees=100), 0.192),
        Equal(f.twist(f.cylinder(), degrees=100), f.cylinder(), sign=True),
    ],
    "bend": [Volume(f.bend(CUBOID, degrees=70), 0.192)],
    "noise": [Equal(f.noise(BALL, amplitude=1e-9), BALL, sign=True)],
}
"""Truths by the name of the formula."""
