"""A box of coloured walls under a glowing ceiling, on paths, against Mitsuba 3 (`pip install mitsuba`).

Both follow paths of the same length from the same camera; the walls are diffuse, one block is a rough metal
that reflects all light (GGX). The noise is that of the difference of two pictures of each, with other random
numbers; a ratio of 1 is a difference of noise alone. Pixels within three of an edge are left out, where our
normals are those of a pixel's width. Mitsuba samples the ceiling, we meet it by chance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

from fracslice.formulas import Node, box, material, transform
from fracslice.rendering import Renderer
from fracslice.rendering.accumulator import SampleRange
from fracslice.rendering.progressive import layer
from fracslice.rendering.units.camera import linear
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.work import Work

from ..runner import Figures, Row, Run, timed

RUNS = 2
NEEDS = "mitsuba"
SMALLEST = {"width": 48, "height": 36, "samples": 4, "others": 4}
CAMERA = Camera(eye=(0.0, -3.8, 0.0), target=(0.0, 0.0, 0.0), fov=40)
BOUNCES = 6
EDGE = 3
"""Pixels beside an edge that are left out."""
GLOW = 1.5
WHITE, RED, GREEN = (0.85, 0.85, 0.85), (0.8, 0.2, 0.15), (0.2, 0.7, 0.25)


@dataclass(frozen=True)
class Block:
    """A box: centre, size, turn about the z axis in degrees, colour, glow and roughness of a metal."""

    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    colour: tuple[float, float, float] = WHITE
    turn: float = 0.0
    glow: float = 0.0
    metal: float = 0.0


BLOCKS = (
    Block((0, 0, -1.1), (2.4, 2.4, 0.2)),
    Block((0, 0, 1.1), (2.4, 2.4, 0.2)),
    Block((0, 1.1, 0), (2.4, 0.2, 2.0)),
    Block((-1.1, 0, 0), (0.2, 2.0, 2.0), RED),
    Block((1.1, 0, 0), (0.2, 2.0, 2.0), GREEN),
    Block((0, 0, 0.97), (1.98, 1.98, 0.06), (1, 1, 1), glow=GLOW),
    Block((-0.35, 0.35, -0.4), (0.6, 0.6, 1.2), (1, 1, 1), turn=20, metal=0.4),
    Block((0.4, -0.2, -0.7), (0.6, 0.6, 0.6), turn=-18),
)


def renderer(width: int, height: int, seed: int, work: Work) -> Renderer:
    view = View(
        camera=CAMERA,
        lights=(Light(kind="sky", strength=0),),
        shading=Shading(paths="yes", bounces=BOUNCES),
    )
    return Renderer(scene(), view, (width, height), work, "cpu", SampleRange(seed=seed))


def ours(width: int, height: int, samples: int, seed: int, work: Work) -> np.ndarray:
    *_, last = renderer(width, height, seed, work).passes(samples, tolerance=0.0)
    return last.image.astype(np.float64)


def flat(width: int, height: int, work: Work) -> np.ndarray:
    """Mask of the pixels that show one plane, with those around them."""
    of = renderer(width, height, 0, work)
    normal, position = layer(of, "normal"), layer(of, "position")
    planes = np.concatenate([normal, (normal * position).sum(2, keepdims=True)], 2)
    window = (2 * EDGE + 1, 2 * EDGE + 1, 1)
    spread = maximum_filter(planes, window) - minimum_filter(planes, window)
    return np.asarray((spread < 0.02).all(2) & (abs(normal).sum(2) > 0.5))


def scene() -> Node:
    return reduce(lambda a, b: a | b, map(placed, BLOCKS))


def placed(of: Block) -> Node:
    solid = transform(box(size=of.size), translate=of.centre, rotate=(0, 0, 1, of.turn))
    look = {"metallic": 1.0, "roughness": of.metal} if of.metal else {"glow": of.glow}
    return material(solid, colour=of.colour, specular=0, **look)


def theirs(mi: Any, width: int, height: int, samples: int, seed: int) -> np.ndarray:
    to_world = mi.ScalarTransform4f
    parts = {}
    for k, of in enumerate(BLOCKS):
        turned = to_world().translate(of.centre).rotate((0, 0, 1), of.turn)
        parts[f"block{k}"] = {
            "type": "cube",
            "to_world": turned.scale([s / 2 for s in of.size]),
            "bsdf": _bsdf(of),
            **({"emitter": {"type": "area", "radiance": _rgb([of.glow] * 3)}} if of.glow else {}),
        }
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
    camera = {
        "type": "perspective",
        "fov": CAMERA.fov,
        "fov_axis": "y",
        "to_world": to_world().look_at(CAMERA.eye, CAMERA.target, CAMERA.up),
        "film": {**film, "pixel_format": "rgb"},
        "sampler": {"type": "independent", "sample_count": samples},
    }
    integrator = {"type": "path", "max_depth": BOUNCES + 1}
    made = mi.load_dict({"type": "scene", "integrator": integrator, "sensor": camera, **parts})
    return np.array(mi.render(made, seed=seed), np.float64)


def _rgb(colour: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": list(colour)}


def _bsdf(of: Block) -> dict[str, Any]:
    if of.metal:
        return {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": of.metal**2}
    # What glows also scatters here: its colour is that of the light and of the surface.
    return {"type": "diffuse", "reflectance": _rgb(linear(of.colour))}


def rows(
    run: Run, width: int = 160, height: int = 120, samples: int = 256, others: int = 256
) -> Iterator[Row]:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    work, pictures = Work(run.threads[0]), {"fracslice": [], "Mitsuba": []}  # type: ignore[var-annotated]

    def act(name: str, draw: Any) -> Figures:
        seed = len(pictures[name])
        return {"cpu_s": timed(lambda: pictures[name].append(draw(seed)))["cpu_s"]}

    measured = run.interleaved(
        {
            "fracslice": lambda: act("fracslice", lambda seed: ours(width, height, samples, seed, work)),
            "Mitsuba": lambda: act("Mitsuba", lambda seed: theirs(mi, width, height, others, seed)),
        }
    )
    inside = flat(width, height, work)
    mean = {name: np.mean(seen, 0)[inside] for name, seen in pictures.items()}
    noise = {name: rms(np.std(seen, 0, ddof=1)[inside]) for name, seen in pictures.items()}
    count = len(pictures["fracslice"])
    expected = math.hypot(noise["fracslice"], noise["Mitsuba"]) / math.sqrt(count)
    yield {
        "": f"{width} x {height}, {samples} and {others} samples",
        "pixels": float(inside.mean()),
        "mean light / Mitsuba's": float(mean["fracslice"].mean() / mean["Mitsuba"].mean()),
        "difference / noise": rms(mean["fracslice"] - mean["Mitsuba"]) / expected,
        "noise / Mitsuba's": noise["fracslice"] / noise["Mitsuba"],
        "CPU time / Mitsuba's": measured.ratio("fracslice", "Mitsuba", "cpu_s"),
    }


def rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))
