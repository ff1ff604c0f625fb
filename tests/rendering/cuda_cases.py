"""Pictures that use every loop and most units of the CUDA renderer, small ones."""

from __future__ import annotations

from pathlib import Path
from tempfile import gettempdir

import numpy as np
from PIL import Image

from fracslice.formulas import (
    Node,
    box,
    get,
    mandelbulb,
    material,
    menger,
    plane,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.rendering.linking import Frame, link_frame
from fracslice.rendering.setup import optics
from fracslice.scene.view import Camera, Film, Fog, Light, Shading, View

WIDTH, HEIGHT = 8, 6
SUN = Light(kind="sun", position=(1.0, -2.0, 3.0))
SKY = Light(kind="sky", strength=0.5)
SOFT = (
    Light(kind="sun", position=(1.0, -2.0, 3.0), size=3.0),
    Light(kind="lamp", position=(2.0, -1.0, 2.0), size=0.3),
    SKY,
)


def _glass() -> Node:
    material = get("material")
    mirror = transform(material(box(), reflect=0.5), translate=(1.2, 0.3, 0.0))
    return union(material(sphere(radius=0.8), clear=0.9, reflect=0.1), mirror, plane(offset=-1.2))


def _surroundings() -> str:
    """A picture of 16 x 8 pixels, one of them bright."""
    path = Path(gettempdir()) / "fracslice-surroundings.png"
    pixels = np.full((8, 16, 3), 60, np.uint8)
    pixels[1:3, 3] = 255
    Image.fromarray(pixels).save(path)
    return str(path)


CASES: dict[str, tuple[Node, View]] = {
    "fractal": (mandelbulb(iterations=5), View(lights=(SUN,), shading=Shading(ambient=0.1))),
    "soft shadows, fog, occlusion": (
        menger(level=2),
        View(lights=SOFT, fog=Fog(density=0.05), shading=Shading(ambient=0.1, occlusion=0.5)),
    ),
    "depth of field": (torus(), View(camera=Camera(aperture=0.05), lights=(SKY,))),
    "glass and mirrors": (_glass(), View(lights=(SKY, SUN), shading=Shading(bounces=4))),
    "transparent film, light at the camera": (
        torus(),
        View(film=Film(alpha="yes"), lights=(Light(kind="camera"), SKY), fog=Fog(density=0.2)),
    ),
    "bodies that glow": (
        union(
            *(transform(material(sphere(radius=0.3), glow=3), translate=(x, 0, 0.8)) for x in (-1, 1)), box()
        ),
        View(lights=(Light(kind="sun", size=3.0),), shading=Shading(paths="yes", bounces=1)),
    ),
    "rough metal and glass, paths": (
        union(get("material")(torus(), metallic=0.7, roughness=0.4), _glass()),
        View(lights=SOFT, shading=Shading(paths="yes", bounces=2)),
    ),
    "surroundings, a sun that rays meet": (
        union(get("material")(torus(), metallic=0.7, roughness=0.4), plane(offset=-1.2)),
        View(
            lights=(Light(kind="environment", file=_surroundings(), rotation=70.0), SOFT[0]),
            shading=Shading(paths="yes", bounces=2),
        ),
    ),
    "texture, lacquer, shafts of light": (
        material(torus(), texture=_surroundings(), coat=0.8, vary=0.4, roughness=0.2),
        View(lights=SOFT[:1], fog=Fog(density=0.2, height=0.6, scatter=0.7), shading=Shading(bounces=2)),
    ),
    "normals": (torus(), View(shading=Shading(mode="normal"))),
    "fisheye": (torus(), View(camera=Camera(kind="fisheye", fov=200.0, eye=(0.0, -1.0, 0.6)), lights=(SUN,))),
    "all around": (
        torus(),
        View(camera=Camera(kind="equirectangular", stereo=0.1, eye=(0.0, -1.0, 0.6)), lights=(SUN,)),
    ),
    "steps": (torus(), View(shading=Shading(mode="steps"))),
}


def frame(name: str) -> Frame:
    root, view = CASES[name]
    camera = view.camera or Camera()
    return link_frame(root, view, camera, optics(camera, (WIDTH, HEIGHT), root, 1e-5))
