"""Light, material and camera for a mesh. Run as a program, it draws one picture off screen.

The module imports nothing else of fracslice: `picture` runs it by its path in a separate process, since VTK
ends the process on a machine that cannot draw.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

CLAY = "#efe3d0"
INSIDE = "#b3543f"  # inner side, visible after a cut
COLOURS = "RGB"
"""Name of the colours in the data of points."""

CLAY_LIGHT = {"ambient": 0.2, "diffuse": 1.0, "specular": 0.06, "specular_power": 12}
BACKGROUNDS = {"light": ("#c4c9cd", "#f4f5f5"), "dark": ("#08090b", "#2a2f37")}  # bottom, top
SHARP = 50.0  # feature angle, degrees: edges above it are drawn sharp
THREE_QUARTER = (0.62, -1.0, 0.52)
FILLED = 0.86  # fraction of the picture that the model fills


def body(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], colours: NDArray[np.uint8] | None = None
) -> Any:
    """Convert a mesh to a VTK surface, smooth except at sharp edges.

    `vertices`: float64 (n, 3); `triangles`: int32 (m, 3); `colours`: uint8 (n, 3).
    """
    import pyvista

    surface: Any = pyvista.PolyData()
    surface.points = vertices.astype(np.float32)
    surface.regular_faces = triangles
    if colours is not None:
        surface.point_data[COLOURS] = colours
    return surface.compute_normals(
        cell_normals=False, split_vertices=True, feature_angle=SHARP, consistent_normals=False
    )


def set_lighting(plotter: Any, surface: Any, background: str, brightness: float = 1.0) -> Any:
    """Add a mesh in its colours or in clay, under a key, a fill and a rim light, in a three-quarter view."""
    import pyvista

    below, above = BACKGROUNDS[background]
    plotter.set_background(below, top=above)
    own = COLOURS in surface.point_data
    colour = (
        {"scalars": COLOURS, "rgb": True} if own else {"color": CLAY, "backface_params": {"color": INSIDE}}
    )
    actor = plotter.add_mesh(surface, **colour, **CLAY_LIGHT)
    plotter.remove_all_lights()
    for position, intensity, tint in (
        ((-0.7, 1.0, 1.2), 0.95, "#fff4e2"),
        ((1.3, 0.1, 0.6), 0.38, "#d5e3ff"),
        ((0.2, 0.9, -1.4), 0.4, "#ffffff"),
    ):
        plotter.add_light(
            pyvista.Light(
                position=position, intensity=intensity * brightness, color=tint, light_type="camera light"
            )
        )
    look(plotter, surface)
    return actor


def look(plotter: Any, surface: Any) -> None:
    """Set a three-quarter view from the front, slightly from above, that fills the picture."""
    plotter.view_vector(THREE_QUARTER, viewup=(0, 0, 1))
    camera = plotter.camera
    back = np.array(camera.position) - np.array(camera.focal_point)
    distance = np.linalg.norm(back)
    back /= distance
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    points = np.asarray(surface.points, dtype=np.float64) - camera.focal_point
    depth = (distance - points @ back) * np.tan(np.radians(camera.view_angle / 2))
    width, height = plotter.window_size
    across = np.abs(points @ right / depth).max() * height / width
    upright = np.abs(points @ np.cross(back, right) / depth).max()
    camera.zoom(FILLED / max(across, upright))


def draw(source: str, target: str, width: int, height: int, background: str) -> None:
    """Draw a mesh to a PNG file.

    `width`, `height` in pixels.
    """
    import pyvista

    with np.load(source) as arrays:
        surface = body(arrays["vertices"], arrays["triangles"], arrays.get("colours"))
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[width, height])
    set_lighting(plotter, surface, background)
    plotter.enable_ssao(radius=surface.length / 25, bias=surface.length / 2000, kernel_size=64, blur=True)
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(target)


if __name__ == "__main__":
    draw(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), sys.argv[5])
