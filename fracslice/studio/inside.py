"""The inside of a scene, without a page: its mesh, its layers, what a check finds, and measures, each made in
the background and shown by the camera of the picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..checks.layer_checks import PrintReport, check_layers
from ..checks.problems import Problem, verdict
from ..common.arrays import triple
from ..common.messages import format_count
from ..common.messages import place as place_text
from ..common.parameters import REQUIRED, Choice, Length, Parameter
from ..errors import FracsliceError, SceneError
from ..export.layers import PRINTS, printers_file, slice_format, write_slices
from ..fields.box import Box, Triple
from ..jobs.mesh import make_mesh
from ..jobs.slices import SliceRecipe
from ..mesh.clusters import Clusters
from ..mesh.drawing import BEHIND, MeshDrawing, MeshView, Plane, Size
from ..records import SAME, MeshJob, Print, SliceJob
from ..rendering.live import Drawing, Live, Shown
from ..rendering.setup import footprint
from ..scene import Scene
from ..scene.layout import SOLID
from ..scene.model import to_xml
from ..scene.view import Camera
from ..slicing import plan_layers
from ..slicing.printers import default_resin, printer
from ..volume import with_depths
from ..volume.amount import sizing
from ..volume.extent import extent
from ..work import Work
from .cut_face import CutFace
from .document import Document
from .handles import LightHandle
from .layer_view import LayerImage, PrintLayers, Window
from .measuring import Mark, Overlay, Tracer, outline, readout
from .solid import SceneSolid, legend, thickness_at
from .views import Pixel, Views

MODES = "field", "mesh", "layers"

FINENESS = 128.0
"""Voxels along the longest side of the first mesh."""

LAYER = 0.05
"""Height of the first layers, mm."""

POINT, WRONG, BED = (255, 255, 255), (255, 96, 96), (120, 132, 156)
"""Colours of measured points, of a problem and of a printer's build volume, sRGB."""

APPROACH = 0.5
"""Distance from which a problem is seen, longest sides."""

STEP = 1.25
"""Factor of a step of the wheel on the enlargement of a layer."""


class Host(Protocol):
    """What the inside needs of a studio."""

    live: Live
    views: Views
    document: Document

    @property
    def scene(self) -> Scene:
        """The last valid scene."""

    @property
    def cut_plane(self) -> Plane | None:
        """The plane that cuts the picture open."""

    def run(self, name: str, make: Callable[[Work], str]) -> None:
        """Begin a job in the background, if none is running; it says what it made."""

    def edit(self, change: Callable[..., None], *arguments: Any) -> None:
        """Change the document, and show what it is now."""

    def set_part(self, part: str, attribute: str, value: str | None) -> None:
        """Give an attribute of an element below `<scene>` a value, or take it away."""


class Footing(NamedTuple):
    """Where an object stands."""

    origin: Triple  # middle of its lower face, scene units
    scale: float  # mm per scene unit

    def units(self, place: Triple) -> NDArray[np.float64]:
        """A place of a problem in scene units."""
        return np.asarray(np.array(self.origin) + np.array(place) / self.scale)


class MeshPicture:
    """Draws a mesh for the page, and a coarse copy of a large one while the camera moves."""

    def __init__(self, view: MeshView, clusters: Clusters | None) -> None:
        self.view = view
        self._coarse = replace(view, mesh=clusters.mesh(view.mesh)) if clusters else None
        self._last: MeshDrawing | None = None

    def __call__(self, camera: Camera, size: Size) -> NDArray[np.uint8]:
        """See `rendering.live.Drawing`."""
        self._last = self.view.draw(camera, size)
        return self._last.pixels

    @property
    def moving(self) -> Drawing | None:
        """What draws the copy, if there is one."""
        return self._draw_coarse if self._coarse else None

    def _draw_coarse(self, camera: Camera, size: Size) -> NDArray[np.uint8]:
        assert self._coarse
        self._last = None
        return self._coarse.draw(camera, size).pixels

    def drawn(self, live: Live) -> MeshDrawing:
        """The picture that is seen, or will be in a moment."""
        return self._last or self.view.draw(live.aim, live.size)


@dataclass(eq=False)
class LayerPicture:
    """Draws a layer for the page."""

    inside: Inside
    layers: PrintLayers
    index: int
    window: Window
    at: tuple[float, float] | None  # place that is marked, mm

    def __call__(self, _: Camera, size: Size) -> NDArray[np.uint8]:
        """See `rendering.live.Drawing`."""
        try:
            seen = self.inside.look(self.layers, self.index)
        except FracsliceError as error:
            self.inside.message = str(error)
            return np.full((size[1], size[0], 3), BEHIND, np.uint8)
        return self.layers.picture(seen, self.window, size, self.at)


class Inside:
    """The inside of the scene of a studio."""

    def __init__(self, host: Host, work: Work) -> None:
        self._host, self._work = host, Work(work.threads)  # its progress is that of no job
        self.fineness, self.edges, self.measure = FINENESS, False, ""
        self.printer, self.layer = "", LAYER
        self.measuring, self.bed, self.distances = False, False, False
        self.release()

    def release(self) -> None:
        """Forget all that was made, and show the field."""
        self.mode, self.message, self.designed = "field", "", False
        self.solids: dict[bool, tuple[Scene, SceneSolid]] = {}  # by whether print edits were left out
        self.index, self.window = 0, Window()
        self.layers: PrintLayers | None = None
        self.report: PrintReport | None = None
        self.chosen: int | None = None
        self.points: list[NDArray[np.float64]] = []  # scene units
        self.there: list[tuple[str, str]] = []  # what is known of the last point
        self.hovered = ""
        self.overlay = Overlay(())
        self._picture: MeshPicture | LayerPicture | None = None
        self._drawn_as: object = None  # mesh, colours, edges and section of the picture
        self._layered: Scene | None = None
        self._seen: tuple[PrintLayers, int, LayerImage] | None = None
        self._footing: tuple[Scene, Footing] | None = None
        self._face: tuple[Scene, Plane, CutFace] | None = None
        self._host.live.draw(None)

    # what is shown

    @property
    def has_made(self) -> bool:
        """True if there is anything to forget."""
        return bool(self.solids or self.layers)

    @property
    def solid(self) -> SceneSolid | None:
        """The mesh that is shown: as printed, or as designed."""
        made = self.solids.get(self.designed)
        return made[1] if made else None

    def show(self, mode: str) -> None:
        """Show the field, the mesh or the layers; what is not there yet is made."""
        self.mode = mode
        if mode == "mesh" and self.solid is None:
            self.make_mesh(self.fineness)
        elif mode == "layers" and self.layers is None:
            self.plan(self.printer, self.layer)
        self.draw()

    def draw(self) -> None:
        """Have the picture show what stands now."""
        self._picture = self._drawing()
        picture = self._picture
        self._host.live.draw(picture, picture.moving if isinstance(picture, MeshPicture) else None)
        self._mark()

    def _drawing(self) -> MeshPicture | LayerPicture | None:
        if self.mode == "mesh" and (solid := self.solid):
            measure = self.measure if self.measure in solid.known else ""
            key = solid, measure, self.edges, self._host.cut_plane
            if self._drawn_as != key or not isinstance(self._picture, MeshPicture):
                self._drawn_as = key
                mesh = solid.coloured(measure) if measure else solid.mesh
                return MeshPicture(MeshView(mesh, *key[2:]), solid.clusters)
            return self._picture
        if self.mode == "layers" and self.layers:
            problem = self.problem
            at = problem.at[:2] if problem and problem.at and problem.layer == self.index else None
            return LayerPicture(self, self.layers, self.index, self.window, at)
        return None

    def _mark(self) -> None:
        """Draw marks over the picture: points that were measured, a problem, the build volume."""
        marks = list[Mark]()
        if self.mode != "layers":
            marks += [Mark(np.array([p]), POINT, False, str(k + 1)) for k, p in enumerate(self.points)]
            if len(self.points) > 1:
                marks.append(Mark(np.array(self.points), POINT))
            if (problem := self.problem) and problem.at:
                marks.append(Mark(self.footing.units(problem.at)[None], WRONG, False, problem.kind))
            if self.bed and self.printer:
                marks += outline(self._build_volume(), BED)
        self.overlay = Overlay(tuple(marks))

    def _build_volume(self) -> Box:
        """Build volume of the printer around the object, scene units."""
        footing, (width, depth, height) = self.footing, printer(self.printer).build_volume
        low = footing.units((-width / 2, -depth / 2, 0.0))
        high = footing.units((width / 2, depth / 2, height))
        return Box(triple(low), triple(high))

    @property
    def footing(self) -> Footing:
        """Where the object stands: as layers or mesh have it, else as the scene says."""
        scene = self._host.scene
        if self.layers and self._layered is scene:
            return Footing(self.layers.stack.origin, self.layers.stack.scale)
        if (made := self.solids.get(self.designed)) and made[0] is scene:
            result = made[1].result
            (x0, y0, z0), (x1, y1, _) = result.report.mesh.bbox_mm
            middle = result.place.units(np.array([[(x0 + x1) / 2, (y0 + y1) / 2, z0]]))[0]
            return Footing(triple(middle), result.place.scale)
        if self._footing is None or self._footing[0] is not scene:
            box = extent(with_depths(scene.root, self._work), self._work).box
            (x, y, _), low = box.centre, box.lo[2]
            self._footing = scene, Footing((x, y, low), sizing(scene, None, SAME, self._work).scale(box))
        return self._footing[1]

    @property
    def face(self) -> CutFace | None:
        """The face of the cut through the field, where its distances are shown."""
        scene, plane = self._host.scene, self._host.cut_plane
        if not self.distances or plane is None or self.mode != "field":
            return None
        if self._face is None or self._face[:2] != (scene, plane):
            root = with_depths(scene.root, self._work)
            face = CutFace(root, plane, extent(root, self._work).box, self.footing.scale)
            self._face = scene, plane, face
        return self._face[2]

    def over(self, shown: Shown, handle: LightHandle | None = None) -> NDArray[np.uint8]:
        """The picture with its marks, the handle of a light, and the face of a cut in colours."""
        pixels, size = shown.pixels, self._host.live.size
        if face := self.face:
            pixels = face.over(pixels, shown.camera, size)
        marks = self.overlay.marks
        if handle and self.mode == "field":
            marks = (*marks, handle.mark(shown.camera))
        return Overlay(marks).over(pixels, shown.camera, size) if marks else pixels

    # the mesh

    def make_mesh(self, fineness: float, designed: bool | None = None) -> None:
        """Make the mesh of the scene, of so many voxels along its longest side, and show it.

        `designed`: whether print edits are left out; by default as in the mesh that is shown.
        """
        designed = self.designed if designed is None else designed
        self.fineness, scene = fineness, self._host.scene
        what = MeshJob(resolution=fineness, printing=Print() if designed else None)
        measure = self.measure

        def make(work: Work) -> str:
            solid = SceneSolid(make_mesh(scene, what, work))
            _ = solid.clusters  # here, and not at the first move
            if measure:
                solid.measure(measure, work)
            self.solids[designed] = scene, solid
            self.mode, self.designed = "mesh", designed
            self.draw()
            return f"mesh of {solid.result.report.mesh.triangles:,} triangles"

        self._host.run("the mesh", make)

    def colour(self, measure: str) -> None:
        """Show a measure of the surface as colours; "" for none."""
        self.measure, solid = measure, self.solid
        if solid and measure and measure not in solid.known:

            def make(work: Work) -> str:
                solid.measure(measure, work)
                self.draw()
                return f"{measure} of {len(solid.mesh.vertices):,} vertices"

            self._host.run(measure, make)
        else:
            self.draw()

    def compare(self, designed: bool) -> None:
        """Show the mesh as it was designed, without print edits, or as it is printed."""
        made = self.solids.get(designed)
        if made and made[0] is self._host.scene:
            self.designed = designed
            self.draw()
        else:
            self.make_mesh(self.fineness, designed)

    # layers and checks

    def _job(self) -> SliceJob:
        machine = printer(self.printer) if self.printer else None
        return SliceJob(layer=self.layer, printer=machine, printing=self._host.scene.printing)

    def plan(self, name: str, layer: float) -> None:
        """Plan the layers for a printer, "" for any, in layers of some mm."""
        self.printer, self.layer = name, layer
        self._host.run("layers", partial(self._planned, self._host.scene))

    def _planned(self, scene: Scene, work: Work) -> str:
        job = self._job()
        stack = plan_layers(scene.root, job, work, sizing(scene, None, SAME, work))
        resin = default_resin(job.printer, job.layer[0]) if job.printer else None
        layers = PrintLayers(stack, self._work, job.printer, resin)
        layers.survey()
        self.chosen, self.report, self.layers, self._layered = None, None, layers, scene
        self.index = min(self.index or len(layers) // 2, len(layers) - 1)
        self.draw()
        return f"{len(layers):,} layers"

    @property
    def layer_options(self) -> dict[str, Any]:
        """Options of the command that writes these layers."""
        printing = {"printer": self.printer} if self.printer else {}
        return {**printing, "layer": f"{self.layer:g}mm"}

    def check_file(self, path: Path) -> None:
        """Raise an error for a file of layers that the chosen printer does not read."""
        kind, machine = slice_format(path), self._job().printer
        if kind in PRINTS and machine is None:
            raise SceneError(f"{path.name}: choose the printer of the layers first")
        if machine and (other := printers_file(machine, path)):
            raise SceneError(other)

    def write_layers(self, path: Path, scene: Scene, work: Work) -> str:
        """Write the layers as a file."""
        job, kind = self._job(), slice_format(path)
        resin = default_resin(job.printer, job.layer[0]) if job.printer else None
        recipe = SliceRecipe(to_xml(scene), scene.name, job, kind, resin, datetime.now(UTC))
        run = recipe.run(work, scene)
        write_slices(run, path)
        return f"{path.name}: {format_count(run.layers, 'layer')}"

    def scrub(self, index: int) -> None:
        """Show another layer."""
        if self.layers:
            self.index = min(max(index, 0), len(self.layers) - 1)
            self.draw()

    def look(self, layers: PrintLayers, index: int) -> LayerImage:
        """A layer; the last one is kept."""
        if self._seen is None or self._seen[:2] != (layers, index):
            self._seen = layers, index, layers.look(index)
        return self._seen[2]

    def check(self) -> None:
        """Check the layers in the background; they are planned first, if that was not done."""
        scene = self._host.scene

        def make(work: Work) -> str:
            if self.layers is None or self._layered is not scene:
                self._planned(scene, work)
            assert self.layers is not None
            report = check_layers(self.layers.stack, None, self.layers.printer, work)
            self.chosen, self.report = None, report
            self.draw()
            return verdict(report.problems)

        self._host.run("the check", make)

    @property
    def problem(self) -> Problem | None:
        """The problem that was chosen."""
        return None if self.report is None or self.chosen is None else self.report.problems[self.chosen]

    def go_to(self, number: int) -> None:
        """Fly to a problem: to its layer, or to its place."""
        self.chosen = number
        problem = self.problem
        if problem and problem.layer is not None:
            self.index = problem.layer
        if problem and problem.at and self.mode == "layers":
            self.window = Window(*problem.at[:2], max(self.window.zoom, 4.0))
        elif problem and problem.at:
            place = self.footing.units(problem.at)
            tracer = self._tracer_at(triple(place))
            self._host.views.fly_to(tracer.view(place, self._host.live.aim, APPROACH * self._longest))
        self.draw()

    @property
    def _longest(self) -> float:
        """Longest side of the object, scene units."""
        assert self.layers is not None
        return max(self.layers.stack.size) / self.layers.stack.scale

    # measuring

    def _tracer_at(self, place: Triple) -> Tracer:
        """The field that is shown, around a place."""
        root, camera, size = self._host.live.root, self._host.live.camera, self._host.live.size
        box = root.bounds.box if root.bounds.box.finite else Box((-10.0,) * 3, (10.0,) * 3)
        growth, base = footprint(camera, size)
        return Tracer(root, box, growth * math.dist(camera.eye, place) + base)

    def pick(self, at: Pixel) -> None:
        """Measure the point that is under the mouse, after those before."""
        found = self._surface_at(at)
        if found is None:
            return
        point, self.there = found
        self.points.append(point)
        self._mark()

    def _surface_at(self, at: Pixel) -> tuple[NDArray[np.float64], list[tuple[str, str]]] | None:
        """Point of the surface at a pixel, and names and values of what is known of it."""
        if isinstance(self._picture, MeshPicture):
            spot, solid = self._picture.drawn(self._host.live).at(*at), self.solid
            if spot is None or solid is None:
                return None
            point = np.array(spot.point)
            width = thickness_at(solid, point, np.array(spot.normal)) if spot.corners else math.inf
            return point, [("thickness", f"{width:.4g} mm")] if math.isfinite(width) else []
        seen = self._host.views.surface_at(at)
        if seen is None:
            return None
        tracer, scale = self._tracer_at(seen), self.footing.scale
        point = tracer.snapped(np.array(seen))
        known = {"thickness": tracer.thickness(point), "radius": tracer.radius(point)}
        lengths = [(name, scale * length) for name, length in known.items() if math.isfinite(length)]
        return point, [(name, f"{length:.4g} mm") for name, length in lengths]

    def forget(self) -> None:
        """Forget the points that were measured."""
        self.points, self.there = [], []
        self._mark()

    def hover(self, at: Pixel) -> None:
        """Say what is under the mouse."""
        self.hovered = ""
        if isinstance(self._picture, MeshPicture) and self.solid:
            self.hovered = self.solid.value(self.measure, self._picture.drawn(self._host.live), *at)

    @property
    def is_flat(self) -> bool:
        """True while a layer is shown, which is moved and enlarged in place of the camera."""
        return self.mode == "layers" and self.layers is not None

    def drag(self, right: float, down: float) -> None:
        """Move a layer with the mouse, by pixels."""
        assert self.layers is not None
        scale = self.window.scale(self.layers.stack, self._host.live.size)
        self.window = self.window.dragged(right, down, scale)
        self.draw()

    def zoom(self, steps: float) -> None:
        """Enlarge a layer."""
        self.window = self.window.zoomed(STEP**steps)
        self.draw()

    # print edits

    @property
    def edits(self) -> list[dict[str, Any]]:
        """Print edits and the size, as JSON: name, text, choices or mm, the most of a slider, help."""
        size = self._host.document.part(SOLID.name)
        rows = [_edit("size", SOLID.parameters["size"], size.attributes.get("size") if size else None)]
        tag = self._host.document.part(Print.element)
        for name, kind in Print.kinds().items():
            if isinstance(kind, (Length, Choice)):
                rows.append(_edit(name, kind, tag.attributes.get(name) if tag else None))
        return rows

    def edit(self, name: str, value: str) -> None:
        """Change a print edit, or the size; an empty one is taken away."""
        if name == "size":
            self._host.edit(self._resize, value or None)
        else:
            self._host.set_part(Print.element, name, value or None)

    def _resize(self, size: str | None) -> None:
        """Give the object a size, in place of that which a unit gave it."""
        document = self._host.document
        solid = document.part(SOLID.name)
        if solid is not None:
            with document.one_edit():
                document.set_value(solid.place, "unit", None)
                document.set_value(solid.place, "size", size)

    # what the page says

    @property
    def told(self) -> dict[str, Any]:
        """What a page shows, as JSON."""
        scene, solid = self._host.scene, self.solid
        made = self.solids.get(self.designed)
        points = [self.footing.scale * point for point in self.points] if self.points else []
        return {
            "mode": self.mode,
            "fineness": self.fineness,
            "edges": self.edges,
            "measure": self.measure,
            "designed": self.designed,
            "edited": scene.printing != Print(),
            "stale": bool(made and made[0] is not scene),
            "figures": solid.figures if solid else [],
            "other": self._other_figures(),
            "legend": legend(solid, self.measure) if solid and self.measure in solid.known else None,
            "hovered": self.hovered,
            "printer": self.printer,
            "layer": self.layer,
            "index": self.index,
            "count": len(self.layers) if self.layers else 0,
            "old": bool(self.layers and self._layered is not scene),
            "rows": self._layer_rows(),
            "verdict": verdict(self.report.problems) if self.report else "",
            "problems": [self._row(problem) for problem in self.report.problems] if self.report else [],
            "chosen": self.chosen,
            "measuring": self.measuring,
            "measures": [*self._last_point(points), *readout(points)],
            "bed": self.bed,
            "distances": self.distances,
            "face": self._face[2].legend if self._face and self.distances else None,
        }

    def _other_figures(self) -> list[tuple[str, str]]:
        """Figures of the mesh that is not shown: before print edits, or after."""
        made = self.solids.get(not self.designed)
        return made[1].figures if made and made[0] is self._host.scene else []

    def _layer_rows(self) -> list[tuple[str, str]]:
        if self.layers is None:
            return []
        seen = self._seen
        now = seen[2] if seen and seen[:2] == (self.layers, self.index) else None
        return self.layers.figures(now, self.index, self.report)

    def _last_point(self, points: list[NDArray[np.float64]]) -> list[tuple[str, str]]:
        """Place of the last point, and what is known of it."""
        if not points:
            return []
        at = points[-1] - self.footing.scale * np.array(self.footing.origin)
        return [(f"point {len(points)}", f"{place_text(at.tolist(), 3)} mm"), *self.there]

    def _row(self, problem: Problem) -> dict[str, Any]:
        """A problem as a page lists it."""
        return {
            "kind": problem.kind,
            "text": str(problem),
            "mend": [list(setting) for setting in problem.mend],
        }


SLIDER = 5.0
"""Most of a slider of a length, mm, unless twice the length is more."""


def _edit(name: str, kind: Parameter, text: str | None) -> dict[str, Any]:
    """A print edit as a page shows it; `text`: its value, None where it is not given."""
    default = "" if kind.default in (None, REQUIRED) else kind.text(kind.default)
    made = {"name": name, "text": default if text is None else text, "doc": kind.doc}
    if isinstance(kind, Choice):
        return made | {"choices": list(kind.choices)}
    try:
        value = float(kind.read(made["text"]) or 0.0) if made["text"] else 0.0
    except ValueError:
        value = 0.0
    most = max(SLIDER, 2 * value)
    return made | {"choices": None, "value": value, "most": most, "step": most / 100}
