"""Renderers for a camera that moves: hard lights, and depth and precision that follow the distance."""

from __future__ import annotations

from dataclasses import replace

from ..errors import SceneError
from ..formulas.registry import Node
from ..scene.view import Camera, View
from ..work import Work
from .progressive import Renderer
from .setup import clearance, default_lights

NEARER = 2.0
"""Ratio of surface distances, in either direction, at which depth and precision are chosen again."""
VISIBLE = 0.7
"""Fraction of the sky that is visible from an average point of a fractal."""


def drafted(root: Node, view: View) -> View:
    """Return a view whose pictures are free of noise after one sample: hard shadows and a sharp lens.

    Parameters
    ----------
    root : Node
        Root of the formula tree.
    view : View
        The view.

    Returns
    -------
    View
        The view with lights of no size, a sky without shadows, a pinhole camera and no reflections.
    """
    lights = tuple(
        replace(light, shadows="no", strength=light.strength * VISIBLE)
        if light.surrounds
        else replace(light, size=0.0)
        for light in view.lights or default_lights(root)
    )
    camera = view.camera and replace(view.camera, aperture=0.0)
    return replace(view, camera=camera, lights=lights, shading=replace(view.shading, bounces=0, paths="no"))


class Follower:
    """Renderer of a scene that follows a camera.

    Parameters
    ----------
    root : Node
        Root of the formula tree; depths may be "auto".
    view : View
        The view; its camera is used until `follow` sets another one.
    work : Work
        Threads, progress and cancellation.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.
    """

    def __init__(self, root: Node, view: View, work: Work, device: str) -> None:
        self._root, self._view, self._work, self._device = root, view, work, device
        self._renderer: Renderer | None = None
        self._distance_then = 0.0

    def follow(self, camera: Camera | None, size: tuple[int, int]) -> Renderer:
        """Return a renderer of an empty picture; it is made again only if depth or size must change.

        Parameters
        ----------
        camera : Camera or None
            The camera; None for the view's.
        size : tuple of int
            Picture width and height, pixels.

        Raises
        ------
        SceneError
            If the view cannot be rendered from this camera.
        """
        made = self._renderer
        if made and camera and (made.width, made.height) == size and self._near(camera):
            made.look(camera)
            return made
        view = replace(self._view, camera=camera) if camera else self._view
        self._renderer = made = Renderer(self._root, view, size, self._work, self._device)
        self._distance_then = self.distance
        return made

    def _near(self, camera: Camera) -> bool:
        """True if depth and precision suit the camera's distance to the surface."""
        assert self._renderer
        try:
            distance = clearance(self._renderer.setup.root, camera)
        except SceneError:  # inside the solid at this depth
            return False
        return self._distance_then / NEARER < distance < self._distance_then * NEARER

    @property
    def distance(self) -> float:
        """Lower bound of the distance from the camera to the surface, scene units."""
        assert self._renderer
        return clearance(self._renderer.setup.root, self._renderer.setup.camera)
