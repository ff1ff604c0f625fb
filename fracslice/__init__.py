"""Fractals as signed distance fields, made into printable meshes.

A scene is a tree of formulas and a size, from a file or from one expression:

>>> from fracslice.formulas import difference, menger, sphere
>>> from fracslice.scene import read, reads, scene, to_xml
>>> cheese = scene(difference(menger(level=2), sphere(radius=1.2)), size="30mm", name="cheese")
>>> print(to_xml(cheese), end="")
<scene version="1">
  <solid size="30mm">
    <difference>
      <menger level="2"/>
      <sphere radius="1.2"/>
    </difference>
  </solid>
</scene>
>>> reads(to_xml(cheese)) == cheese
True

Values can be changed from outside, as ``--set`` does:

>>> smaller = cheese.with_values(["menger.level=1", "solid.size=2cm"])
>>> smaller.root, smaller.size_mm
(difference(menger(level=1), sphere(radius=1.2)), 20.0)

One call makes the mesh, in mm, and a report on it. *What* to make (`MeshJob`) is apart from *how* (`Work`):

>>> from fracslice import MeshJob, Work, make_mesh, write
>>> result = make_mesh(cheese, MeshJob(resolution=48), Work(threads=2))
>>> result.mesh.size.round(3).tolist()
[30.0, 30.0, 30.0]
>>> result.report.mesh.printable, result.report.mesh.components
(True, 1)

The mesh goes to a file of the kind that its name says, whole or not at all:

>>> import tempfile, pathlib
>>> with tempfile.TemporaryDirectory() as folder:
...     write(result.mesh, pathlib.Path(folder) / "cheese.3mf").name
'cheese.3mf'
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .api.meshing import Result, make_mesh
    from .api.pictures import Picture, render
    from .api.slices import Slices, slice_layers
    from .errors import FracsliceError
    from .export import write
    from .formulas import (
        Node,
        bend,
        bounds,
        box,
        capsule,
        cone,
        cylinder,
        difference,
        intersection,
        julia,
        mandelbulb,
        material,
        menger,
        mirror,
        octahedron,
        offset,
        plane,
        repeat,
        shell,
        sphere,
        torus,
        transform,
        twist,
        union,
    )
    from .mesh import Mesh
    from .meshjob import MeshJob
    from .report import Report
    from .scene import Scene, read, reads, to_xml
    from .work import Work

_FORMULAS = (
    "bend",
    "bounds",
    "box",
    "capsule",
    "cone",
    "cylinder",
    "difference",
    "intersection",
    "julia",
    "mandelbulb",
    "material",
    "menger",
    "mirror",
    "octahedron",
    "offset",
    "plane",
    "repeat",
    "shell",
    "sphere",
    "torus",
    "transform",
    "twist",
    "union",
)

_WHERE = {
    "FracsliceError": "errors",
    "Mesh": "mesh",
    "MeshJob": "meshjob",
    "Node": "formulas",
    "Picture": "api.pictures",
    "Report": "report",
    "Result": "api.meshing",
    "Scene": "scene",
    "Slices": "api.slices",
    "Work": "work",
    "make_mesh": "api.meshing",
    "read": "scene",
    "reads": "scene",
    "render": "api.pictures",
    "slice_layers": "api.slices",
    "to_xml": "scene",
    "write": "export",
    **dict.fromkeys(_FORMULAS, "formulas"),
}

__all__ = [
    "FracsliceError",
    "Mesh",
    "MeshJob",
    "Node",
    "Picture",
    "Report",
    "Result",
    "Scene",
    "Slices",
    "Work",
    "bend",
    "bounds",
    "box",
    "capsule",
    "cone",
    "cylinder",
    "difference",
    "intersection",
    "julia",
    "make_mesh",
    "mandelbulb",
    "material",
    "menger",
    "mirror",
    "octahedron",
    "offset",
    "plane",
    "read",
    "reads",
    "render",
    "repeat",
    "shell",
    "slice_layers",
    "sphere",
    "to_xml",
    "torus",
    "transform",
    "twist",
    "union",
    "write",
]


def __getattr__(name: str) -> Any:
    """The public names, loaded when first used, so that importing fracslice costs nothing."""
    if name == "__version__":
        return import_module(".report", __name__).version()
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_WHERE[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_WHERE])
