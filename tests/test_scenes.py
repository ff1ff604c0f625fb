"""The gallery: every shipped scene reads, fits the schema, says what it is, and becomes a printable solid."""

from __future__ import annotations

import pytest
from lxml import etree

from fracslice import MeshJob, make_mesh
from fracslice.fields.definitions import definitions
from fracslice.mesh.model import to_manifold
from fracslice.scene import library, read, reads, to_xml
from fracslice.scene.layout import formulas
from fracslice.scene.manual import OPEN, PATH
from tests.examples import stamped

pytestmark = pytest.mark.once

NAMES = library.names()
FINE = ("lattice-cube", "mandelbulb", "pendant", "three-worlds")
"""Scenes that are made at 256 voxels, too."""
OFTEN = (
    "bauble",
    "hybrid",
    "mandelbox",
    "menger-tower",
    "pendant",
    "quaternion-julia",
    "three-worlds",
)
"""Scenes that are made in every run; the others in a night."""


def test_there_are_at_least_ten_and_they_show_what_there_is():
    used = {node.formula.name for name in NAMES for node in read(library.path(name)).root.walk()}
    assert len(NAMES) >= 10
    assert used >= {"mandelbulb", "julia", "menger", "mandelbox", "gyroid", "orbit"}
    assert used >= {"sphere", "box", "torus", "cylinder", "capsule", "cone", "plane"}
    assert used >= {f.name for f in formulas() if f.kind != "shape"} - {
        "mirror",
        "offset",
        "material",
        "noise",
        "infill",
        "relief",
        "displace",
        "thicken",
        "onion",
        "scaffold",
        "preimage",
    }


@pytest.mark.parametrize("name", NAMES)
def test_it_fits_the_schema_and_survives_writing(name):
    scene = read(library.path(name))
    schema = etree.RelaxNG(etree.parse(OPEN if definitions(scene.root) else PATH))
    assert schema.validate(etree.parse(library.path(name))), schema.error_log
    assert reads(to_xml(scene)) == scene
    assert len(library.about(name)) > 20


@pytest.mark.parametrize(
    ("name", "resolution"),
    stamped(
        [*((name, 128) for name in NAMES), *((name, 256) for name in FINE)], [(name, 128) for name in OFTEN]
    ),
)
def test_it_becomes_a_solid_that_prints(name, resolution):
    scene = read(library.path(name))
    result = make_mesh(scene, MeshJob(resolution=resolution))
    report = result.report
    assert report.problems == ()
    assert report.mesh.watertight
    assert report.mesh.manifold
    assert report.mesh.oriented
    assert to_manifold(result.mesh).status().name == "NoError"
    assert abs(result.mesh.size.max() - scene.size_mm) < report.voxel_mm
    assert report.mesh.components == 1, "one piece, to hold in a hand"
    assert report.surface_error_mm.mean < report.voxel_mm / 2
