"""Layers read by programs of others: CLI by the Rust crate colain, SVG drawn by librsvg, the mesh of a 3MF by
PrusaSlicer. (3MF by lib3mf: `test_slices`; print files: `test_prints`.) Skipped where the program is missing.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice.export.layers import write_slices
from fracslice.export.slice_run import SliceRun
from fracslice.formulas import difference, menger, sphere
from fracslice.jobs.slices import StackModel
from fracslice.scene import scene
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.slicing.raster import Screen
from fracslice.work import Work

SVG = "{http://www.w3.org/2000/svg}svg"


@pytest.fixture(scope="module")
def run() -> SliceRun:
    """Layers with holes, and islands in them."""
    root = difference(menger(level=2), sphere(radius=1.05))
    stack = plan_stack(root, SliceJob(size=12, layer=0.5, pixel=(0.1, 0.1)))
    return SliceRun(stack, Screen(stack))


@pytest.fixture(scope="module")
def layers(run: SliceRun) -> np.ndarray:
    """Loops and mm^2 of each layer, [n, 2]."""
    return np.array(list(Slicer(run.stack).map(lambda layer: (len(layer.contours), layer.contours.area))))


@pytest.mark.skipif(not shutil.which("cargo"), reason="needs cargo")
def test_cli_by_colain(run: SliceRun, layers: np.ndarray, tmp_path: Path) -> None:
    crate = tmp_path / "crate"
    shutil.copytree(Path(__file__).parent / "colain", crate)
    built = subprocess.run(
        ["cargo", "build", "--release", "--quiet", "--locked"], cwd=crate, capture_output=True
    )
    if built.returncode:
        pytest.skip("the crate cannot be had here")
    path = write_slices(run, tmp_path / "part.cli", "cli-binary")
    reported = subprocess.run(
        [crate / "target/release/layers", path], check=True, capture_output=True, text=True
    )
    result = np.array([line.split() for line in reported.stdout.splitlines()], float) * (1, 1e-6)
    np.testing.assert_allclose(result, layers, rtol=1e-5)


def drawn(data: bytes, background: str) -> np.ndarray:
    """A picture, 0 for the background's opposite, by librsvg."""
    command = ["rsvg-convert", "--width", "1024", "--background-color", background]
    reported = subprocess.run(command, input=data, check=True, capture_output=True)
    with Image.open(io.BytesIO(reported.stdout)) as image:
        return np.asarray(image.convert("L")) / 255


@pytest.mark.skipif(not shutil.which("rsvg-convert"), reason="needs rsvg-convert")
def test_svg_by_librsvg(run: SliceRun, layers: np.ndarray, tmp_path: Path) -> None:
    """One file a layer, and the groups of the layered one: white solid, black holes."""
    folder = write_slices(run, tmp_path / "svg", "svg")
    root = ET.parse(write_slices(run, tmp_path / "part.svg")).getroot()
    window = run.stack.shape[0] * run.stack.shape[1] * run.stack.pixel[0] * run.stack.pixel[1]
    for k in (0, 5, 11):
        alone = 1 - drawn((folder / f"{k:05d}.svg").read_bytes(), "white")
        group = ET.Element(SVG, root.attrib)
        group.append(root[k])
        layered = drawn(ET.tostring(group), "black")
        result = [alone.mean() * window, layered.mean() * window]
        np.testing.assert_allclose(result, layers[k, 1], rtol=2e-3)


@pytest.mark.skipif(not shutil.which("prusa-slicer"), reason="needs prusa-slicer")
def test_3mf_by_prusaslicer(tmp_path: Path) -> None:
    """It reads no slices; the mesh beside them is the object, not its box."""
    root, job = (
        difference(menger(level=1), sphere(radius=0.9)),
        SliceJob(size=12, layer=0.5, pixel=(0.3, 0.3)),
    )
    stack, mesh = plan_stack(root, job), StackModel(scene(root, size=12), job, Work()).mesh
    path = write_slices(SliceRun(stack, Screen(stack), mesh=mesh), tmp_path / "part.3mf")
    command = ["prusa-slicer", "--info", path]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    values = dict(line.split(" = ") for line in lines if " = " in line)
    assert values["manifold"] == "yes"
    assert float(values["size_z"]) == pytest.approx(12, abs=1e-3)
    area = sum(Slicer(stack).map(lambda layer: layer.contours.area))
    assert float(values["volume"]) == pytest.approx(area * 0.5, rel=0.03)
