"""Fractals as signed distance fields, made into printable meshes.

Shapes are functions and combine by operators:

>>> from fracslice import make_mesh, menger, render, slice_layers, sphere
>>> cheese = menger(2) - sphere(1.2)
>>> cheese
difference(menger(level=2), sphere(radius=1.2))
>>> float(cheese.distance([0, 0, 2]))
1.0

One call makes the mesh, in mm, and its report. `Mesh.export` writes a file atomically, in the format of its
extension:

>>> mesh = make_mesh(cheese, size="30mm", resolution=48)
>>> mesh.size.round(3).tolist(), mesh.is_watertight
([30.0, 30.0, 30.0], True)
>>> mesh.report.problems, mesh.report.mesh.components
((), 1)
>>> import tempfile, pathlib
>>> with tempfile.TemporaryDirectory() as folder:
...     mesh.export(pathlib.Path(folder) / "cheese.3mf").name
'cheese.3mf'

Layers of a print and pictures are arrays:

>>> slice_layers(cheese, layer=1, size="30mm", pixel=0.5)[0].dtype.name
'uint8'
>>> render(cheese, size=(32, 24), samples=1).shape
(24, 32, 3)

A scene is a shape with a size, print settings and a view. It is built in Python or read from a file:

>>> from fracslice import Scene, reads, to_xml
>>> scene = Scene(cheese, "30mm", name="cheese")
>>> print(to_xml(scene), end="")
<scene version="1">
  <solid size="30mm">
    <difference>
      <menger level="2"/>
      <sphere radius="1.2"/>
    </difference>
  </solid>
</scene>
>>> reads(to_xml(scene)) == scene
True

A scene's values can be overridden by name, like the option ``--set``:

>>> smaller = scene.with_values(["menger.level=1", "solid.size=2cm"])
>>> smaller.root, smaller.size_mm
(difference(menger(level=1), sphere(radius=1.2)), 20.0)

Keywords are short for the fields of two records, the settings of the mesh (`MeshJob`) and its execution
(`Work`):

>>> from fracslice import MeshJob, Work
>>> make_mesh(smaller, MeshJob(resolution=27), Work(threads=2)).report.mesh.printable
True
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False
"""True for type checkers alone. The command guards its imports against Ctrl-C only after this module."""
if TYPE_CHECKING:
    from typing import Any

_WHERE = {
    "Camera": "scene.view",
    "FracsliceError": "errors",
    "Light": "scene.view",
    "Mesh": "mesh",
    "MeshJob": "records",
    "Node": "formulas",
    "Picture": "api.calls",
    "Print": "scene",
    "RenderJob": "records",
    "Report": "jobs.report",
    "Result": "jobs.report",
    "Scene": "scene",
    "Slices": "api.calls",
    "Studio": "studio.notebook",
    "Work": "work",
    "__version__": "version",
    "from_function": "volume.level_sets",
    "from_grid": "volume.level_sets",
    "from_trimesh": "mesh.models",
    "from_vdb": "volume.level_sets",
    "make_mesh": "api.calls",
    "read": "scene",
    "reads": "scene",
    "render": "api.calls",
    "slice_layers": "api.calls",
    "sweep": "api.calls",
    "to_xml": "scene",
    "write": "formats",
    "write_vdb": "api.calls",
}

_PACKAGE = "volume"
"""Formula with the name of a package of ours: here it is `from_vdb`. `sweep` is the call, not the
formula of this name, which is `formulas.sweep`.
"""


def __getattr__(name: str) -> Any:
    """Load a public name on first use, so that importing fracslice loads no other modules."""
    formulas: Any = import_module(".formulas", __name__) if name not in _WHERE else None
    if name == "__all__":
        return sorted({*_WHERE, *formulas.names()} - {_PACKAGE})
    if formulas and name not in formulas.names():
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = formulas.get(name) if formulas else getattr(import_module(f".{_WHERE[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *__getattr__("__all__")})
