"""Units of cameras, and their parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..scene.view import Camera
from .optics import footprint
from .units import camera as units

Unit = tuple[Callable[..., Any], dict[str, Any]]


def camera_unit(camera: Camera, size: tuple[int, int]) -> Unit:
    """Return the unit of a camera.

    Parameters
    ----------
    camera : Camera
        The camera.
    size : tuple of int
        Width and height of the film, pixels.

    Returns
    -------
    callable
        Function of `units.camera`.
    dict
        Its parameters.
    """
    return _KINDS[camera.kind](camera, size)


def _flat(camera: Camera, size: tuple[int, int], pixel: float) -> dict[str, Any]:
    """A plane film at distance 1: its corner and its steps per pixel."""
    width, height = size
    right, up = np.array(camera.right), np.array(camera.above)
    corner = np.array(camera.forward) - right * (pixel * width / 2) + up * (pixel * height / 2)
    return {
        "eye": camera.eye,
        "corner": tuple(corner),
        "across": tuple(right * pixel),
        "down": tuple(-up * pixel),
    }


def _perspective(camera: Camera, size: tuple[int, int]) -> Unit:
    pixel, _ = footprint(camera, size)
    right, up = np.array(camera.right), np.array(camera.above)
    focus = camera.focus or math.dist(camera.eye, camera.target)
    if camera.stereo:
        half = size[0] // 2
        eyes = {"offset": tuple(right * camera.stereo / 2), "half": float(half), "focus": focus}
        return units.stereo, _flat(camera, (half, size[1]), pixel) | eyes
    values = _flat(camera, size, pixel)
    if camera.aperture == 0:
        return units.pinhole, values
    axes = {"right": tuple(right * camera.aperture), "up": tuple(up * camera.aperture), "focus": focus}
    return units.lens, values | axes


def _orthographic(camera: Camera, size: tuple[int, int]) -> Unit:
    _, pixel = footprint(camera, size)
    values = _flat(camera, size, pixel)
    corner = np.array(values["corner"]) - camera.forward + camera.eye
    return units.orthographic, values | {"corner": tuple(corner), "forward": camera.forward}


def _fisheye(camera: Camera, size: tuple[int, int]) -> Unit:
    pixel, _ = footprint(camera, size)
    middle = {"middle": (size[0] / 2, size[1] / 2), "pixel": pixel}
    return units.fisheye, _axes(camera) | middle


def _equirectangular(camera: Camera, size: tuple[int, int]) -> Unit:
    width = size[0] // 2 if camera.stereo else size[0]
    film = {"width": float(width), "height": float(size[1]), "radius": camera.stereo / 2}
    return units.equirectangular, _axes(camera) | film


def _axes(camera: Camera) -> dict[str, Any]:
    axes = {"right": camera.right, "up": camera.above, "forward": camera.forward}
    return {"eye": camera.eye} | axes


_KINDS: dict[str, Callable[[Camera, tuple[int, int]], Unit]] = {
    "perspective": _perspective,
    "orthographic": _orthographic,
    "fisheye": _fisheye,
    "equirectangular": _equirectangular,
}
