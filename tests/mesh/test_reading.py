"""Model files from elsewhere, good and broken."""

from __future__ import annotations

import json
import math
import re
import signal
import struct
import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fracslice.errors import MeshError
from fracslice.formats import write
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.models import read_mesh

from .shapes import cube

TYPES = '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"/>'
RELATIONS = (
    '<Relationships><Relationship Target="/3D/box.model" Id="r" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def box(
    path: Path, unit: str = "millimeter", build: str = '<item objectid="1"/>', more: str = "", head: str = ""
) -> Path:
    """A 3MF of a cube of 10 units."""
    mesh = cube()
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.triangles)
    model = (
        f'{head}<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
        f'<object id="1" type="model"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles>'
        f"</mesh></object>{more}</resources><build>{build}</build></model>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("[Content_Types].xml", TYPES)
        archive.writestr("_rels/.rels", RELATIONS)
        archive.writestr("3D/box.model", model)
    return path


@pytest.mark.parametrize(
    ("unit", "side"), [("millimeter", 10), ("inch", 254), ("micron", 0.01), ("meter", 10000)]
)
def test_3mf_units(tmp_path: Path, unit: str, side: float) -> None:
    assert read_mesh(box(tmp_path / "box.3mf", unit)).size == pytest.approx([side] * 3, rel=1e-6)


def test_3mf_transforms_and_components(tmp_path: Path) -> None:
    pair = (
        '<object id="2"><components><component objectid="1"/>'
        '<component objectid="1" transform="1 0 0 0 1 0 0 0 1 20 0 0"/></components></object>'
    )
    item = '<item objectid="2" transform="0 1 0 -1 0 0 0 0 2 5 6 7"/>'
    mesh = read_mesh(box(tmp_path / "pair.3mf", build=item, more=pair))
    assert mesh.bounds.tolist() == [[-5, 6, 7], [5, 36, 27]]
    report = check_mesh(mesh)
    assert report.printable
    assert (report.components, report.volume_mm3) == (2, pytest.approx(4000))


def test_3mf_mirror_images_are_not_inside_out(tmp_path: Path) -> None:
    item = '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>'
    assert check_mesh(read_mesh(box(tmp_path / "mirror.3mf", build=item))).printable


def test_3mf_components_in_other_files_of_the_package(tmp_path: Path) -> None:
    inner = box(tmp_path / "inner.3mf", "inch", build="")
    with zipfile.ZipFile(inner) as archive:
        model = archive.read("3D/box.model")
    component = '<component p:path="/3D/Objects/1.model" objectid="1" transform="1 0 0 0 2 0 0 0 1 0 0 0"/>'
    more = f'<object id="2" xmlns:p="production"><components>{component}</components></object>'
    whole = box(tmp_path / "whole.3mf", build='<item objectid="2"/>', more=more)
    with zipfile.ZipFile(whole, "a") as archive:
        archive.writestr("3D/Objects/1.model", model.replace(b'"10.0"', b'"5"'))
    assert read_mesh(whole).size.tolist() == [5, 10, 5]


@pytest.mark.parametrize("change", [{8: 1}, {6: 255}])
def test_3mf_that_is_encrypted_or_of_a_later_version(tmp_path: Path, change: dict[int, int]) -> None:
    path = box(tmp_path / "locked.3mf")
    data = bytearray(path.read_bytes())
    for at in (match.start() for match in re.finditer(rb"PK\x01\x02", data)):
        for offset, value in change.items():
            data[at + offset] = value
    path.write_bytes(data)
    with pytest.raises(MeshError, match=r"locked\.3mf: not a whole 3MF file"):
        read_mesh(path)


@pytest.mark.filterwarnings("error")
def test_stl_of_a_signalling_nan(tmp_path: Path) -> None:
    path = write(cube(), tmp_path / "nan.stl")
    data = bytearray(path.read_bytes())
    data[96:100] = struct.pack("<I", 0x7FA00000)
    path.write_bytes(data)
    with pytest.raises(MeshError, match="not a finite number"):
        read_mesh(path)


def second(content: str) -> dict[str, str]:
    return {"more": f'<object id="2">{content}</object>', "build": '<item objectid="2"/>'}


NO_VERTICES = '<mesh><vertices/><triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh>'
NO_NUMBER = '<mesh><vertices><vertex x="1" y="b" z="0"/></vertices></mesh>'
TWICE = (
    '<mesh><vertices><vertex x="1" y="2" z="0"/><vertex x="1" y="3" z="0"/></vertices>'
    '<triangles><triangle v1="0" v2="0" v3="1"/></triangles></mesh>'
)


INNER = '<object id="{}"><components>{}</components></object>'
TENFOLD, CHAIN = (
    "".join(INNER.format(k, times * f'<component objectid="{k - 1}"/>') for k in range(2, 99))
    for times in (10, 1)
)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"unit": "parsec"}, "no such unit: parsec"),
        ({"build": ""}, "asks to build nothing"),
        ({"build": '<item objectid="9"/>'}, "no such object: 9"),
        ({"build": '<item objectid="1" transform="1 2 3"/>'}, "not a valid 3MF"),
        (second('<components><component objectid="2"/></components>'), "nested more than 32 deep"),
        (second(NO_VERTICES), "does not exist"),
        (second(TWICE), "names a vertex twice"),
        (second(NO_NUMBER), "not a valid 3MF"),
        (second(TWICE.replace('v3="1"', f'v3="{10**20}"')), "not a valid 3MF"),
        (second(TWICE.replace('y="3"', 'y="1e999"')), "coordinate is not a finite number"),
        ({"build": '<item objectid="1" transform="nan 0 0 0 1 0 0 0 1 0 0 0"/>'}, "not of finite numbers"),
        (
            {"more": TENFOLD, "build": '<item objectid="11"/>'},
            "more than 2097152 vertices, triangles and parts",
        ),
        (
            {"more": CHAIN, "build": "".join(f'<item objectid="{k}"/>' for k in range(1, 99))},
            "nested more than 32 deep",
        ),
        ({"build": '<item objectid="1"/>' * (1 << 16)}, "more than 65536 objects and parts"),
        (
            {
                "more": INNER.format(2, '<component objectid="1"/>' * 400)
                + INNER.format(3, '<component objectid="2"/>' * 400),
                "build": '<item objectid="3"/>',
            },
            "more than 2097152 vertices, triangles and parts",
        ),
        ({"more": f"<object{' ' * (3 << 20)}/>"}, "a tag of more than 1 MB"),
        ({"more": "<object>"}, "not a .*3MF"),
        ({"head": '<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>'}, "document type"),
    ],
)
def test_3mf_that_is_wrong(tmp_path: Path, change: dict[str, str], words: str) -> None:
    with pytest.raises(MeshError, match=words) as failure:
        read_mesh(box(tmp_path / "wrong.3mf", **change))
    assert "\n" not in str(failure.value)


def test_components_are_expanded_once(tmp_path: Path) -> None:
    beside = '<component objectid="{0}"/><component objectid="{0}" transform="1 0 0 0 1 0 0 0 1 {1} 0 0"/>'
    more = "".join(INNER.format(k, beside.format(k - 1, 20 << k)) for k in range(2, 17))
    began = time.process_time()
    mesh = read_mesh(box(tmp_path / "many.3mf", more=more, build='<item objectid="16"/>'))
    assert len(mesh.triangles) == 12 << 15
    assert time.process_time() - began < 2


def fan(corners: int) -> Mesh:
    """A polygon as a fan of triangles."""
    k, turn = np.arange(corners, dtype=np.int32), 2 * np.pi * np.arange(corners) / corners
    points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    return Mesh(points, np.stack([0 * k[2:], k[1:-1], k[2:]], 1))


@pytest.mark.parametrize("ending", [".stl", ".3mf", ".ply", ".obj"])
def test_a_vertex_of_too_many_triangles(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"fan{ending}"
    write(fan(8194), path)
    assert len(read_mesh(path).triangles) == 8192
    write(fan(8195), path)
    with pytest.raises(MeshError, match="8193 corners of triangles meet at a vertex: expected at most 8192"):
        read_mesh(path)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
def test_ply_with_lists_in_place_of_coordinates(tmp_path: Path, kind: str) -> None:
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex 3\nproperty list uchar float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = [("Bffff", 2, k, 0, k, k * k) for k in range(3)] + [("Biii", 3, 0, 1, 2)]
    text = "".join(" ".join(map(str, row[1:])) + "\n" for row in rows).encode()
    binary = b"".join(struct.pack(f"<{row[0]}", *row[1:]) for row in rows)
    (tmp_path / "list.ply").write_bytes(head.encode() + (text if kind == "ascii" else binary))
    with pytest.raises(MeshError, match="not a whole PLY file"):
        read_mesh(tmp_path / "list.ply")


def test_numpy_says_nothing_of_numbers_that_are_refused(tmp_path: Path, recwarn) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "far.obj").write_text("v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(MeshError, match="not a finite number"):
        read_mesh(tmp_path / "far.obj")
    assert not recwarn.list


def ascii_stl(path: Path) -> Path:
    lines = ["solid box"]
    for corners in cube().corners:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x:.6e} {y:.6e} {z:.6e}" for x, y, z in corners]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid box", ""]))
    return path


def test_ascii_stl(tmp_path: Path) -> None:
    mesh = read_mesh(ascii_stl(tmp_path / "box.stl"))
    assert np.array_equal(mesh.corners, cube().corners)
    assert len(mesh.vertices) == 8


@pytest.mark.parametrize(
    "change",
    [
        str.upper,
        lambda text: f"\n  {text}",
        lambda text: text + "\n" * 2000,
        lambda text: text.replace("solid box", f"solid {'box' * 2000}"),
    ],
)
def test_ascii_stl_of_other_programs(tmp_path: Path, change) -> None:  # type: ignore[no-untyped-def]
    path = ascii_stl(tmp_path / "box.stl")
    path.write_text(change(path.read_text()))
    assert np.array_equal(read_mesh(path).corners, cube().corners)


@pytest.mark.parametrize(
    "spoil",
    [lambda text: text[: len(text) // 2], lambda text: text.replace("vertex 0.000000e+00", "vertex zero", 1)],
)
def test_ascii_stl_that_is_wrong(tmp_path: Path, spoil) -> None:  # type: ignore[no-untyped-def]
    path = ascii_stl(tmp_path / "box.stl")
    path.write_text(spoil(path.read_text()))
    with pytest.raises(MeshError, match="STL"):
        read_mesh(path)


@pytest.mark.parametrize("name", ["model.stl", "model.3mf", "model.ply", "model.obj", "model.glb"])
def test_nonsense_and_missing_files(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    with pytest.raises(MeshError, match="no such file"):
        read_mesh(path)
    path.write_bytes(b"\x00\xff nonsense " * 40)
    with pytest.raises(MeshError) as failure:
        read_mesh(path)
    assert "\n" not in str(failure.value)


def test_unknown_kind(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"known are \.3mf"):
        read_mesh(tmp_path / "part.step")


PRISM = [(x, y, z) for z in (0, 10) for x, y in ((0, 0), (10, 0), (10, 10), (5, 15), (0, 10))]
PRISM_SIDES = [
    (4, 3, 2, 1, 0),
    (5, 6, 7, 8, 9),
    *((k, (k + 1) % 5, (k + 1) % 5 + 5, k + 5) for k in range(5)),
]


def prism(kind: str) -> bytes:
    """PLY of a prism of five sides, with faces of four and five corners, and a table that no mesh needs."""
    head = (
        f"ply\r\nformat {kind} 1.0\r\ncomment end_header is below\r\nelement note 1\r\n"
        "property list uchar short text\r\nelement vertex 10\r\nproperty double x\r\nproperty double y\r\n"
        "property double z\r\nelement face 7\r\nproperty list uchar int vertex_indices\r\n"
        "property float quality\r\nend_header\r\n"
    )
    rows = [("Bhh", 2, 7, 8), *(("ddd", *corner) for corner in PRISM)]
    rows += [(f"B{len(face)}if", len(face), *face, 0.5) for face in PRISM_SIDES]
    if kind == "ascii":
        return (head + "".join(" ".join(map(str, row[1:])) + "\n" for row in rows)).encode()
    order = "<" if "little" in kind else ">"
    return head.encode() + b"".join(struct.pack(order + str(row[0]), *row[1:]) for row in rows)


KINDS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("kind", KINDS)
def test_ply_of_faces_of_four_and_five_corners(tmp_path: Path, kind: str) -> None:
    (tmp_path / "prism.ply").write_bytes(prism(kind))
    report = check_mesh(read_mesh(tmp_path / "prism.ply"))
    assert report.printable
    assert (report.triangles, report.volume_mm3) == (16, pytest.approx(1250))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rest", [0.97, 0.7, 0.5])
def test_ply_that_is_cut_short(tmp_path: Path, kind: str, rest: float) -> None:
    data = prism(kind)
    (tmp_path / "cut.ply").write_bytes(data[: int(len(data) * rest)])
    with pytest.raises(MeshError, match="not a whole PLY file"):
        read_mesh(tmp_path / "cut.ply")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"4 3 2 1 0", b"4 3 2 1 10"),
        (b"5 4 3 2 1 0", b"-5 4 3 2 1 0"),
        (b"face 7", b"face -7"),
        (b"face 7", b"face 9999999999999"),
        (b"4 3 2 1 0", b"4 3 2 1 nan"),
        (b"property double x", b"property double w"),
    ],
)
def test_ply_that_is_wrong(tmp_path: Path, old: bytes, new: bytes) -> None:
    data = prism("ascii")
    assert old in data
    (tmp_path / "wrong.ply").write_bytes(data.replace(old, new, 1))
    with pytest.raises(MeshError, match="PLY"):
        read_mesh(tmp_path / "wrong.ply")


def obj(path: Path, face: str = "{}", *, below: bool = False, more: str = "") -> Path:
    """OBJ of the prism; `face` has the words of each corner."""
    lines = [f"v {x} {y} {z}" for x, y, z in PRISM]
    lines += ["f " + " ".join(face.format(k - 10 if below else k + 1) for k in side) for side in PRISM_SIDES]
    path.write_text("\n".join(["# of another program", "o prism", *lines, more, ""]))
    return path


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"face": "{}/7/7"},
        {"face": "{}//7"},
        {"face": "{}/7", "below": True},
        {"face": "{} \\\n"},
        {"face": "{} \\\r\n"},
        {"more": "vn 0 0 1\nf 1 2\nl 1 2"},
    ],
)
def test_obj_of_faces_of_four_and_five_corners(tmp_path: Path, how: dict[str, Any]) -> None:
    report = check_mesh(read_mesh(obj(tmp_path / "prism.obj", **how)))
    assert report.printable
    assert (report.triangles, report.volume_mm3) == (16, pytest.approx(1250))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("f 1 2 11", "a vertex that does not exist"),
        ("f 1 2 0", "a vertex that does not exist"),
        ("f 1 2 -11", "a vertex that does not exist"),
        ("f 1 2 x", "not a whole OBJ file"),
        ("f 1 2 99999999999999999999", "not a whole OBJ file"),
        ("v 1 2", "not a whole OBJ file"),
        ("v 1 2 x", "not a whole OBJ file"),
        ("v 1 2 nan\nf 1 2 11", "not a finite number"),
    ],
)
def test_obj_that_is_wrong(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        read_mesh(obj(tmp_path / "wrong.obj", more=more))


def test_a_signal_ends_reading_an_obj_of_mixed_faces(tmp_path: Path) -> None:
    """trimesh swallowed it until the file was read."""
    path = obj(tmp_path / "mixed.obj", more="f 1//1 2//1 3//1\nf 1//1 2//1 3//1 4//1\n" * 200_000)

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.1)
    try:
        with pytest.raises(KeyboardInterrupt):
            read_mesh(path)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def glb(path: Path, *, body: bytes | None = None, **changes: Any) -> Path:
    """GLB of a tetrahedron with sides of 1 m, with changes to its JSON."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], "<f4").tobytes()
    sides = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)], "<u2").tobytes()
    body = corners + sides if body is None else body
    tree: dict[str, Any] = {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [{"byteLength": len(body)}],
    }
    text = json.dumps({**tree, **changes}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


HALF_TURN = {"mesh": 0, "rotation": [0, 1, 0, 0], "scale": [1, 2, 1], "translation": [5, 0, 0]}
MIRRORED = {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -3, 0, 0, 1]}


def test_glb_of_nodes(tmp_path: Path) -> None:
    nodes = [{"mesh": 0, "children": [1, 2]}, HALF_TURN, MIRRORED]
    mesh = read_mesh(glb(tmp_path / "nodes.glb", nodes=nodes))
    report = check_mesh(mesh)
    assert report.printable
    assert (report.components, report.volume_mm3) == (3, pytest.approx(4 / 6 * 1e9))
    assert np.array_equal(mesh.vertices.min(axis=0), [-4000, -1000, 0])
    assert np.array_equal(mesh.vertices.max(axis=0), [5000, 1000, 2000])


@pytest.mark.parametrize(("mode", "corners"), [(5, (0, 2, 1, 3, 0, 2)), (6, (0, 2, 1, 3, 2))])
def test_glb_of_strips_and_fans(tmp_path: Path, mode: int, corners: tuple[int, ...]) -> None:
    path = glb(tmp_path / "whole.glb")
    body = path.read_bytes()[-72:-24] + np.array(corners, "<u2").tobytes()
    primitives = [{"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": len(corners), "type": "SCALAR"},
    ]
    read = read_mesh(glb(path, body=body, meshes=[{"primitives": primitives}], accessors=accessors))
    whole = read_mesh(glb(path))

    def faces(mesh: Mesh) -> set[tuple[tuple[float, ...], ...]]:
        turned = [np.roll(side, -k, axis=0) for side in mesh.corners for k in range(3)]
        return {tuple(map(tuple, side.tolist())) for side in turned}

    assert len(faces(read) & faces(whole)) == 3 * (4 if mode == 5 else 3)


VIEW = {"buffer": 0, "byteLength": 72}
PLACES = {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"accessors": [{"componentType": 5126, "count": 10**9, "type": "VEC3"}] * 2},
            "accessor without data",
        ),
        ({"accessors": [{**PLACES, "sparse": {}}] * 2}, "a sparse one"),
        ({"accessors": [{**PLACES, "count": 10**9}] * 2}, "not a whole GLB file"),
        ({"accessors": [{**PLACES, "count": -1}] * 2}, "not a whole GLB file"),
        ({"accessors": [PLACES] * 2, "bufferViews": [{**VIEW, "byteStride": 0}]}, "not a whole GLB file"),
        ({"accessors": 7}, "not a whole GLB file"),
        ({"nodes": [[]]}, "not a whole GLB file"),
        ({"nodes": [{"children": [0]}]}, "more than 32 levels of nodes"),
        ({"nodes": [{"children": [k + 1] * 2} for k in range(31)] + [{}]}, "more than 65536 nodes"),
        ({"nodes": [{"mesh": 0, "scale": [1, math.nan, 1]}]}, "not a whole GLB file"),
        ({"meshes": [{"primitives": []}]}, "the file has no triangles"),
        ({"buffers": [{"uri": "body.bin"}]}, "data in other files"),
        (
            {"meshes": [{"primitives": [{"extensions": {"KHR_draco_mesh_compression": {}}}]}]},
            r"compressed \(KHR_draco_mesh_compression\)",
        ),
    ],
)
def test_glb_that_is_wrong(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(MeshError, match=message):
        read_mesh(glb(tmp_path / "wrong.glb", **changes))
