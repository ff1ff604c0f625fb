"""3MF, by the core specification 1.3.

Written: one object in millimetres, or objects and a build, with colours by materials 1.2; a thumbnail.
Triangles of filaments are painted, too, in attributes that PrusaSlicer reads (Format/3mf.cpp), and Bambu
Studio and OrcaSlicer (bbs_3mf.cpp), which take the filament of an object from its group of one colour. Read:
the build, with the production extension.
"""

from __future__ import annotations

import zipfile
import zlib
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from itertools import chain
from pathlib import Path
from typing import IO, Any, BinaryIO, NamedTuple
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import (
    COPIES,
    DEEPEST,
    GREY,
    LARGEST,
    MOST_PARTS,
    Triangles,
    concatenate,
    count,
    distinct,
    moved,
)
from ..common.files import HEAD, ROWS, Fragment, Text, append, deflate, join, number_rows, open_regular, rows
from ..errors import MeshError
from ..work import Work
from . import MeshFormat

MODEL = (
    HEAD + '<model unit="millimeter" xml:lang="en-US" '
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:fracslice="urn:fracslice:metadata">\n'
)
PLAIN, VERTICES, TRIANGLES, END_OF_MESH, END = (
    b'<object id="1" type="model">',
    b"<mesh>\n<vertices>\n",
    b"</vertices>\n<triangles>\n",
    b"</triangles>\n</mesh>",
    b'</object></resources>\n<build><item objectid="1"/></build>\n</model>\n',
)
TRIANGLE, END_OF_ROW = ('<triangle v1="', '" v2="', '" v3="'), '"/>\n'
CORE_NAMES = {"Title", "Designer", "Description", "Copyright", "LicenseTerms", "Rating", "Application"}
CORE_NAMES |= {"CreationDate", "ModificationDate"}
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
PAINTS = "http://schemas.slic3r.org/3mf/2017/06"


def _write(mesh: Triangles, file: BinaryIO, metadata: Mapping[str, str], work: Work) -> None:
    """Write a mesh, streamed: threads make and deflate blocks of the text, which are joined.

    See `MeshFormat`. Metadata that 3MF does not define get fracslice's namespace.
    """
    picture, mesh = mesh.thumbnail(), mesh.in_order()
    more = _layer_heights(mesh) | _settings([mesh])
    blocks = work.ordered(lambda text: deflate(text()), _model(mesh, metadata))
    join(file, (partial(append, block) for block in blocks), _are_large([mesh]), more, picture)


PROFILES = "Metadata/Slic3r_PE_layer_heights_profile.txt", "Metadata/layer_heights_profile.txt"
"""Where PrusaSlicer, and Bambu Studio and OrcaSlicer, have heights of layers."""


def _layer_heights(mesh: Triangles) -> dict[str, bytes]:
    """Heights of layers over z, as slicers read them: at both faces of each layer; the last is the top."""
    if mesh.tops is None:
        return {}
    top, inner = float(np.ptp(mesh.vertices[:, 2])), mesh.tops[:-1]
    tops = np.array([*inner[inner < top], top])
    bottoms, heights = np.array([0.0, *tops[:-1]]), np.diff(mesh.tops, prepend=0.0)[: len(tops)]
    rows = np.stack([bottoms, heights, tops, heights], 1).reshape(-1).tolist()
    text = f"object_id=1|{';'.join(f'{number:.6f}' for number in rows)}\n".encode()
    return dict.fromkeys(PROFILES, text)


def _settings(meshes: Sequence[Triangles]) -> dict[str, bytes]:
    """Filaments of bodies, as Bambu Studio and OrcaSlicer read them."""
    groups, objects = _Groups.of(meshes), ""
    for number, mesh in enumerate(meshes, 1):
        parts = "".join(
            f'<part id="{body}" subtype="normal_part"><metadata key="name" value="filament {k}"/>'
            f'<metadata key="extruder" value="{k}"/></part>\n'
            for k, body, _ in groups.bodies(mesh, number)
        )
        if parts:
            objects += f'<object id="{number}">\n<metadata key="extruder" value="1"/>\n{parts}</object>\n'
    if not objects:
        return {}
    return {"Metadata/model_settings.config": f"{HEAD}<config>\n{objects}</config>\n".encode()}


@dataclass(frozen=True, eq=False)
class _Groups:
    """Groups of colours, of the materials extension, that the objects of a file share: one for each filament,
    or one of all colours of vertices. They are numbered after the objects, and bodies after them.
    """

    objects: int  # number of objects
    colours: NDArray[np.uint8]  # sRGB, (k, 3)
    apart: bool  # whether each colour has a group

    @classmethod
    def of(cls, meshes: Sequence[Triangles]) -> _Groups:
        """Groups of meshes, which have the same filaments, if any."""
        printed = [mesh.filaments for mesh in meshes if mesh.filaments is not None]
        if printed:
            return cls(len(meshes), printed[0].colours, True)
        shown = [_packed(mesh.colours) for mesh in meshes if mesh.colours is not None]
        known = distinct(np.concatenate([np.empty(0, np.int64), *shown]))
        colours = np.stack([known >> 16, known >> 8 & 255, known & 255], 1).astype(np.uint8)
        return cls(len(meshes), colours, False)

    @property
    def first(self) -> int:
        """Number of the first group."""
        return self.objects + 1

    def texts(self) -> Iterator[Text]:
        """Elements of the groups."""
        shown = rows('<m:color color="#%02X%02X%02X"/>\n', self.colours)
        if self.apart:
            for group, text in enumerate(b"".join(shown).splitlines(), self.first):
                yield from _texts(b'<m:colorgroup id="%d">%s</m:colorgroup>\n' % (group, text))
        elif len(self.colours):
            yield from _texts(b'<m:colorgroup id="%d">\n' % self.first, *shown, b"</m:colorgroup>\n")

    def indices(self, colours: NDArray[np.uint8]) -> NDArray[np.int32]:
        """Numbers of the colours of vertices in the group."""
        return np.searchsorted(_packed(self.colours), _packed(colours)).astype(np.int32)

    def bodies(self, mesh: Triangles, number: int) -> Iterator[tuple[int, int, Triangles]]:
        """Bodies of an object that are not empty, with the numbers of their filaments, from 1, and of their
        objects.
        """
        before = self.objects + number * len(self.colours)
        for k, body in enumerate(mesh.filaments.bodies if mesh.filaments else (), 1):
            if len(body.triangles):
                yield k, before + k, body


def _packed(colours: NDArray[np.integer]) -> NDArray[np.int64]:
    """Colours as numbers, in the order of red, green and blue."""
    packed: NDArray[np.int64] = colours.astype(np.int64) @ np.array([1 << 16, 1 << 8, 1])
    return packed


class Built(NamedTuple):
    """An object that is built at some places."""

    mesh: Triangles  # mm
    places: Sequence[NDArray[np.float64]]  # four rows by which points, as rows, are moved, [4, 3], mm
    name: str = ""


def write_build(
    objects: Sequence[Built],
    file: BinaryIO,
    metadata: Mapping[str, str],
    work: Work,
    picture: bytes | None = None,
    together: bool = False,
) -> None:
    """Write objects, and a build of them, streamed as one object is.

    `picture`: of all, as PNG; `together`: they are the bodies of one object, at their first places.
    """

    meshes = [built.mesh.in_order() for built in objects]
    groups = _Groups.of(meshes)

    def texts() -> Iterator[Text]:
        yield from _texts(*_head(metadata, _spaces(meshes)))
        yield from groups.texts()
        items = ""
        for number, (mesh, built) in enumerate(zip(meshes, objects, strict=True), 1):
            yield from _object(mesh, groups, number, built.name)
            yield from _texts(b"</object>\n")
            places = (" ".join(f"{v:.9g}" for v in place.ravel().tolist()) for place in built.places)
            what = "component" if together else "item"
            items += "".join(f'<{what} objectid="{number}" transform="{place}"/>\n' for place in places)
        if together:
            whole = (
                f'<object id="{len(objects) + 1}" type="model"><components>{items}</components></object>\n'
            )
            yield from _texts(whole.encode())
            items = f'<item objectid="{len(objects) + 1}"/>\n'
        yield from _texts(f"</resources>\n<build>\n{items}</build>\n</model>\n".encode())

    blocks = work.ordered(lambda text: deflate(text()), texts())
    written = (partial(append, block) for block in blocks)
    join(file, written, _are_large(meshes), _settings(meshes), picture)


def write_fragments(
    vertices: tuple[int, Iterable[Fragment]],
    triangles: tuple[int, Iterable[Fragment]],
    file: BinaryIO,
    metadata: Mapping[str, str],
) -> None:
    """Write a mesh whose rows are deflated."""

    def texts(*blocks: bytes) -> Iterator[Fragment]:
        return (partial(append, deflate(text)) for text in blocks)

    fragments = chain(
        texts(*_head(metadata), PLAIN, VERTICES),
        vertices[1],
        texts(TRIANGLES),
        triangles[1],
        texts(END_OF_MESH, END),
    )
    join(file, fragments, _is_large(vertices[0], triangles[0], False))


def _is_large(vertices: int, triangles: int, coloured: bool, painted: int = 0) -> bool:
    """True if the text may exceed the 2 GiB of a plain ZIP member; rows take at most 66 and 54 bytes.

    `painted`: bytes of the painting.
    """
    vertex, triangle = (92, 140) if coloured else (66, 54)  # with a colour for each vertex, or painted
    return vertex * vertices + triangle * triangles + painted > 2**31 - 2**20


def _are_large(meshes: Sequence[Triangles]) -> bool:
    """True if the text of meshes may exceed the 2 GiB of a plain ZIP member."""
    parts, painting = list(meshes), 0
    for mesh in meshes:
        if mesh.supported is not None:
            painting += len(ENFORCED) * int(mesh.supported.sum())
        if mesh.filaments is not None:
            parts += mesh.filaments.bodies
            lengths = np.array([len(text) for text in mesh.filaments.texts])
            painting += 2 * int(lengths[mesh.filaments.text].sum())
    vertices, triangles = (sum(len(getattr(p, name)) for p in parts) for name in ("vertices", "triangles"))
    return _is_large(vertices, triangles, any(mesh.colours is not None for mesh in meshes), painting)


def _head(metadata: Mapping[str, str], model: str = MODEL) -> Iterator[bytes]:
    """Text before the resources."""
    yield model.encode()
    for key, value in metadata.items():
        name = key if key in CORE_NAMES else f"fracslice:{key}"
        yield f'<metadata name="{escape(name)}">{escape(value)}</metadata>\n'.encode()
    yield b"<resources>"


def _spaces(meshes: Sequence[Triangles]) -> str:
    """Start of a model with the namespaces of its colours and paintings."""
    painted = any(mesh.filaments is not None or mesh.supported is not None for mesh in meshes)
    coloured = any(mesh.filaments is not None or mesh.colours is not None for mesh in meshes)
    spaces = f'xmlns:m="{MATERIALS}" ' * coloured + f'xmlns:slic3rpe="{PAINTS}" ' * painted
    return MODEL.replace("<model ", f"<model {spaces}")


def _model(mesh: Triangles, metadata: Mapping[str, str]) -> Iterator[Text]:
    groups = _Groups.of([mesh])
    yield from _texts(*_head(metadata, _spaces([mesh])))
    yield from groups.texts()
    yield from _object(mesh, groups, 1)
    yield from _texts(END)


def _object(mesh: Triangles, groups: _Groups, number: int, name: str = "") -> Iterator[Text]:
    """An object without its end: with a colour for each vertex, painted for filaments, or of a body for each,
    which are objects before it.
    """
    title = f' name="{escape(name)}"' if name else ""
    if bodies := list(groups.bodies(mesh, number)):
        for k, own, body in bodies:
            of = f'pid="{groups.first + k - 1}" pindex="0"'
            yield from _texts(f'<object id="{own}" name="filament {k}" type="model" {of}>'.encode())
            yield from mesh_element(body.in_order())
            yield from _texts(b"</object>\n")
        components = "".join(f'<component objectid="{own}"/>' for _, own, _ in bodies)
        whole = f'<object id="{number}"{title} type="model"><components>{components}</components>'
        yield from _texts(whole.encode())
        return
    coloured = mesh.filaments is not None or mesh.colours is not None
    of = f' pid="{groups.first}" pindex="0"' * coloured
    yield from _texts(f'<object id="{number}"{title} type="model"{of}>'.encode())
    if mesh.filaments is not None or mesh.supported is not None:
        yield from _painted_element(mesh, groups.first)
    else:
        colours = None if mesh.colours is None else groups.indices(mesh.colours)
        yield from mesh_element(mesh, groups.first, colours)


ENFORCED = ' slic3rpe:custom_supports="4" paint_supports="4"'
"""Attributes of a triangle at which slicers put supports."""


def _painted_element(mesh: Triangles, first: int) -> Iterator[Text]:
    """Mesh element whose triangles have the colour group of their filament, and their painting.

    `first`: number of the first group.
    """
    yield from _texts(VERTICES)
    yield from vertex_rows(mesh.vertices)
    yield from _texts(TRIANGLES)
    groups, texts, plain = [""], [""], "0"  # the text of a triangle that is not painted
    of = text = np.zeros(len(mesh.triangles), np.int32)
    if (painted := mesh.filaments) is not None:
        groups = [f' pid="{first + k}" p1="0"' if k else "" for k in range(len(painted.colours))]
        texts = [f' slic3rpe:mmu_segmentation="{t}" paint_color="{t}"' * (t != plain) for t in painted.texts]
        of, text = painted.of.astype(np.int32), painted.text
    held = of * 0 if mesh.supported is None else mesh.supported.astype(np.int32)
    rows = np.column_stack([mesh.triangles, of, text, held])

    def block(part: slice) -> bytes:
        lines = (
            f'<triangle v1="{a}" v2="{b}" v3="{c}"{groups[k]}{texts[t]}{ENFORCED * h}/>\n'
            for a, b, c, k, t, h in rows[part].tolist()
        )
        return "".join(lines).encode()

    for begin in range(0, len(mesh.triangles), ROWS):
        yield partial(block, slice(begin, begin + ROWS))
    yield from _texts(END_OF_MESH)


def _texts(*blocks: bytes) -> Iterator[Text]:
    return (partial(bytes, block) for block in blocks)


def mesh_element(mesh: Triangles, group: int = 0, colours: NDArray[np.int32] | None = None) -> Iterator[Text]:
    """Encode a mesh as the mesh element of an object, in blocks.

    `mesh` in mm; `group`: number of the group of its colours; `colours`: int32 (n,).
    """
    yield from _texts(VERTICES)
    yield from vertex_rows(mesh.vertices)
    yield from _texts(TRIANGLES)
    if colours is None:
        yield from triangle_rows(mesh.triangles)
    else:
        before = *TRIANGLE, f'" pid="{group}" p1="', '" p2="', '" p3="'
        yield from number_rows(before, END_OF_ROW, np.hstack([mesh.triangles, colours[mesh.triangles]]))
    yield from _texts(END_OF_MESH)


def vertex_rows(vertices: NDArray[np.floating]) -> Iterator[Text]:
    """Encode vertices, in blocks of `text.ROWS`.

    `vertices`: float (n, 3), mm.
    """
    return number_rows(('<vertex x="', '" y="', '" z="'), END_OF_ROW, vertices)


def triangle_rows(triangles: NDArray[np.integer]) -> Iterator[Text]:
    """Encode triangles, in blocks of `text.ROWS`.

    `triangles`: int (n, 3).
    """
    return number_rows(TRIANGLE, END_OF_ROW, triangles)


MILLIMETRES = {
    "micron": 1e-3,
    "millimeter": 1.0,
    "centimeter": 10.0,
    "inch": 25.4,
    "foot": 304.8,
    "meter": 1000.0,
}
LONGEST, CHUNK = 1 << 20, 1 << 16
"""Most bytes of a tag, and bytes that are parsed at once."""
MODEL_RELATION = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"


def _read(path: Path) -> Triangles:
    """The build of a file, mm."""
    return _build(path, _Package())


def read_beams(path: str) -> NDArray[np.float64]:
    """Beams of the build of a file: both ends and radii, mm, [n, 2, 4].

    After "3MF Beam Lattice Extension", 3MF Consortium 2020; clipping, and balls of their own, are left out.
    """
    ends = _build(Path(path), _Lattices()).vertices.reshape(-1, 2, 3, 3)
    radii = np.linalg.norm(ends[:, :, 2] - ends[:, :, 0], axis=-1)
    return np.concatenate([ends[:, :, 0], radii[..., None]], -1)


def _build(path: Path, package: _Package) -> Triangles:
    """The build of a file, mm, that a reader of it collects."""
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            relations = _Relations()
            with archive.open("_rels/.rels") as part:
                _parse(part, relations.start)
            package.read(archive, relations.model)
            return package.laid_out()
    except (zipfile.BadZipFile, EOFError, KeyError, RuntimeError, zlib.error) as error:
        raise MeshError("not a whole 3MF file: it is cut short, or of another kind") from error
    except (expat.ExpatError, ValueError, OverflowError) as error:
        raise MeshError(f"not a valid 3MF file: {error}") from error


def _parse(part: IO[bytes], start: Any, end: Any = None) -> None:
    """Stream XML through handlers. A document type, and hence entities, is refused."""
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = _refuse
    given = 0
    while data := part.read(CHUNK):
        parser.Parse(data, False)
        given += len(data)
        if given - parser.CurrentByteIndex > LONGEST:  # which takes quadratic time
            raise MeshError(f"not a valid 3MF file: it has a tag of more than {LONGEST >> 20} MB")
    parser.Parse(b"", True)


def _refuse(*_: Any) -> None:
    """Refuse a document type."""
    raise MeshError("not a valid 3MF file: it has a document type")


class _Relations:
    """Finds the 3D model in the relationships of the package."""

    model = ""

    def start(self, name: str, attributes: dict[str, str]) -> None:
        if attributes.get("Type") == MODEL_RELATION:
            self.model = attributes.get("Target", "")


_Name = tuple[str, str]
"""File of an object in the package, and its identifier there."""

_Part = tuple[_Name, NDArray[np.float64]]
"""Object and its transform."""


IN_PLACE = np.vstack([np.eye(3), np.zeros(3)])
"""Transform that moves nothing."""


class _Package:
    """Collects the meshes of a 3MF model from XML streams, then expands its build.

    Objects may lie in further files of the package, as its production extension has it.
    """

    def __init__(self) -> None:
        self.meshes: dict[_Name, Triangles] = {}
        self.parts: dict[_Name, list[_Part]] = {}
        self.build: list[_Part] = []
        self.unit, self.file, self.object = "millimeter", "", ("", "")
        self.vertices, self.triangles = array("d"), array("q")
        self.count = 0
        self.expanded: dict[_Name, Triangles] = {}

    def read(self, archive: zipfile.ZipFile, model: str) -> None:
        """Read a model, whose unit and build count, and the files that components name."""
        self.parse(archive, model.lstrip("/"))
        unit, build, known = self.unit, self.build, {self.file}
        while more := self.named(build) - known:
            known |= more
            for file in sorted(more):
                self.parse(archive, file)
        self.unit, self.build = unit, build

    def parse(self, archive: zipfile.ZipFile, file: str) -> None:
        """Collect the objects of a file; its unit and build take the place of earlier ones."""
        self.file, self.build = file, []
        with archive.open(file) as part:
            _parse(part, self.start, self.end)

    def named(self, build: list[_Part]) -> set[str]:
        """Files of the objects that are built or components of others."""
        return {name[0] for placed in (build, *self.parts.values()) for name, _ in placed}

    def start(self, name: str, get: dict[str, str]) -> None:
        """Handle the start of an element."""
        match name.rpartition(":")[2]:
            case "triangle":
                self.triangles.extend((int(get["v1"]), int(get["v2"]), int(get["v3"])))
            case "vertex":
                self.vertices.extend((float(get["x"]), float(get["y"]), float(get["z"])))
            case "object":
                self.count_part()
                self.object = self.file, get["id"]
                self.parts[self.object] = []
            case "levelset":
                raise MeshError("the 3MF file holds a formula (a level set), and no mesh")
            case "component":
                self.parts[self.object].append(self.reference(get))
            case "item":
                self.build.append(self.reference(get))
            case "model":
                self.unit = get.get("unit", self.unit)

    def reference(self, get: dict[str, str]) -> _Part:
        """The object that an item or a component names, in this file or in that of its path."""
        self.count_part()
        paths = [value for key, value in get.items() if key.rpartition(":")[2] == "path"]
        file = paths[0].lstrip("/") if paths else self.file
        return (file, get["objectid"]), _matrix(get.get("transform"))

    def count_part(self) -> None:
        """Count an object, a component or an item."""
        self.count += 1
        if self.count > MOST_PARTS:
            raise MeshError(f"not a valid 3MF file: it has more than {MOST_PARTS} objects and parts")

    def end(self, name: str) -> None:
        """Handle the end of an element."""
        if name.rpartition(":")[2] == "object":
            self.meshes[self.object] = _validated_mesh(self.vertices, self.triangles)
            self.vertices, self.triangles = array("d"), array("q")

    def laid_out(self) -> Triangles:
        """All build items as one mesh, mm."""
        if self.unit not in MILLIMETRES:
            raise MeshError(f"not a valid 3MF file: no such unit: {self.unit}")
        if not self.build:
            raise MeshError("the 3MF file asks to build nothing")
        known: dict[_Name, tuple[int, int]] = {}
        most = max(LARGEST, COPIES * sum(map(count, self.meshes.values())))
        if sum(self.size(name, known)[0] for name, _ in self.build) > most:
            raise MeshError(f"not a valid 3MF file: it builds more than {most} vertices, triangles and parts")
        whole = concatenate([self.placed(*item) for item in self.build])
        return Triangles(whole.vertices * MILLIMETRES[self.unit], whole.triangles, whole.colours)

    def size(self, name: _Name, known: dict[_Name, tuple[int, int]], depth: int = 0) -> tuple[int, int]:
        """Vertices, triangles and objects of an expanded object, and levels of its components.

        An unknown object, and components nested too deep, are refused.
        """
        if name not in self.meshes:
            raise MeshError(f"not a valid 3MF file: no such object: {name[1]}")
        if name not in known and depth <= DEEPEST:
            inner = [self.size(part, known, depth + 1) for part, _ in self.parts[name]]
            sizes, levels = zip((count(self.meshes[name]), -1), *inner, strict=True)
            known[name] = 1 + sum(sizes), 1 + max(levels)
        if depth + known.get(name, (0, 1))[1] > DEEPEST:
            raise MeshError(f"not a valid 3MF file: components are nested more than {DEEPEST} deep")
        return known[name]

    def placed(self, name: _Name, matrix: NDArray[np.float64]) -> Triangles:
        """An object with its components, in the frame of the build."""
        if name not in self.expanded:
            inner = [self.placed(*part) for part in self.parts[name]]
            self.expanded[name] = concatenate([self.meshes[name], *inner])
        whole = self.expanded[name]
        turned = sum(whole.vertices[:, k, None] * matrix[k] for k in range(3))
        return moved(whole, turned + matrix[3], matrix[:3])


class _Coloured(_Package):
    """Collects colours of the corners of triangles, too: those of groups of colours and of base materials."""

    def __init__(self) -> None:
        super().__init__()
        self.groups: dict[_Name, list[int]] = {}
        self.group, self.own, self.corners = ("", ""), ("", "0"), array("q")

    def start(self, name: str, get: dict[str, str]) -> None:
        """Handle the start of an element."""
        super().start(name, get)
        match name.rpartition(":")[2]:
            case "colorgroup" | "basematerials":
                self.group = self.file, get["id"]
                self.groups[self.group] = []
            case "color" | "base":
                text = get.get("color", get.get("displaycolor", ""))
                self.groups.setdefault(self.group, []).append(int(text[1:7], 16))
            case "object":
                self.own = get.get("pid", ""), get.get("pindex", "0")
            case "triangle":
                group, first = get.get("pid", self.own[0]), get.get("p1", self.own[1])
                known = self.groups.get((self.file, group), [])
                for index in (first, get.get("p2", first), get.get("p3", first)):
                    number = int(index)
                    self.corners.append(known[number] if 0 <= number < len(known) else -1)

    def end(self, name: str) -> None:
        """Handle the end of an element."""
        super().end(name)
        if name.rpartition(":")[2] == "object":
            mesh, colours = self.meshes[self.object], np.array(self.corners, dtype=np.int64)
            self.corners = array("q")
            if len(colours) and colours.max() >= 0:
                self.meshes[self.object] = _split(
                    mesh, np.where(colours < 0, _packed(np.array(GREY)), colours)
                )


def _split(mesh: Triangles, colours: NDArray[np.int64]) -> Triangles:
    """A mesh with a vertex for each colour of its corners, of which each is a number."""
    both = mesh.triangles.reshape(-1).astype(np.int64) << 24 | colours
    known, index = np.unique(both, return_inverse=True)
    shown = np.stack([known >> 16 & 255, known >> 8 & 255, known & 255], 1).astype(np.uint8)
    return Triangles(mesh.vertices[known >> 24], index.reshape(-1, 3).astype(np.int32), shown)


def _read_coloured(path: Path) -> Triangles:
    """The build of a file with its colours, mm."""
    return _build(path, _Coloured())


class _Lattices(_Package):
    """Collects beams as meshes: of each end a triangle of it, the other end, and a point at its radius."""

    def __init__(self) -> None:
        super().__init__()
        self.radius, self.beams = "", array("d")

    def start(self, name: str, get: dict[str, str]) -> None:
        """Handle the start of an element."""
        match name.rpartition(":")[2]:
            case "beamlattice":
                self.radius = get["radius"]
            case "beam":
                first = float(get.get("r1", self.radius))
                self.beams.extend((int(get["v1"]), int(get["v2"]), first, float(get.get("r2", first))))
            case "triangle":
                pass
            case _:
                super().start(name, get)

    def end(self, name: str) -> None:
        """Handle the end of an element."""
        if name.rpartition(":")[2] != "object":
            return
        points, beams = np.array(self.vertices).reshape(-1, 3), np.array(self.beams).reshape(-1, 4)
        pairs = beams[:, :2].astype(np.int64)
        if len(pairs) and not 0 <= pairs.min() <= pairs.max() < len(points):
            raise MeshError("a beam names a point that does not exist")
        one, other = points[pairs], points[pairs[:, ::-1]]
        corners = np.stack([one, other, one + beams[:, 2:, None] * (1, 0, 0)], 2).reshape(-1, 3)
        if not np.isfinite(corners).all():
            raise MeshError("has a coordinate or a radius that is not a finite number")
        self.meshes[self.object] = Triangles(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
        self.vertices, self.beams = array("d"), array("d")


def _matrix(text: str | None) -> NDArray[np.float64]:
    """3MF transform: four rows of three numbers, applied to row vectors. Raises ValueError."""
    if text is None:
        return IN_PLACE
    matrix = np.array(text.split(), dtype=np.float64).reshape(4, 3)
    if not np.isfinite(matrix).all():
        raise ValueError(f"a transform that is not of finite numbers: {text[:60]}")
    return matrix


def _validated_mesh(vertices: array[float], triangles: array[int]) -> Triangles:
    """Validated mesh of an object."""
    corners = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    indices = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    if not np.isfinite(corners).all():
        raise MeshError("not a valid 3MF file: a coordinate is not a finite number")
    if len(indices) and not 0 <= indices.min() <= indices.max() < len(corners):
        raise MeshError("not a valid 3MF file: a triangle names a vertex that does not exist")
    if (indices == np.roll(indices, 1, axis=1)).any():
        raise MeshError("not a valid 3MF file: a triangle names a vertex twice")
    return Triangles(corners, indices.astype(np.int32))


FORMAT = MeshFormat(_read, _write, has_unit=True, has_colours=True, read_coloured=_read_coloured)
