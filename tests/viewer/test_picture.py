"""Pictures without a screen, and refusals where none can be made."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from PIL import Image

from fracslice.errors import ExportError, RenderError
from fracslice.mesh import Mesh
from fracslice.slicing.feature_graph import FeatureBox
from fracslice.viewer import picture, show, window
from tests.mesh.shapes import cube, sphere

pytest.importorskip("pyvista")


def drawn(path: Path, mesh: Mesh, **options: str) -> np.ndarray:
    try:
        picture(mesh, path, (160, 120), **options)  # type: ignore[arg-type]
    except RenderError as error:
        pytest.skip(str(error))
    with Image.open(path) as image:
        assert image.size == (160, 120)
        return np.asarray(image.convert("L"), float)


def test_picture_shows_a_lit_body_that_fills_the_frame(tmp_path: Path) -> None:
    light = drawn(tmp_path / "ball.png", sphere(40, at=(500, 0, 0)))
    dark = drawn(tmp_path / "dark.png", sphere(40, at=(500, 0, 0)), background="dark")
    body = abs(light - dark) < 25  # what does not change with the background
    rows, columns = np.flatnonzero(body.any(axis=1)), np.flatnonzero(body.any(axis=0))
    assert 85 < len(rows) < 115
    assert 85 < len(columns) < 115
    assert light[rows.mean().astype(int) - 25, columns.mean().astype(int) - 10] > 150
    assert np.ptp(light[body]) > 60  # shaded, not flat
    assert light[3, 3] > 180 > 60 > dark[3, 3]


def test_size_and_place_do_not_change_the_picture(tmp_path: Path) -> None:
    small = drawn(tmp_path / "small.png", cube(1))
    large = drawn(tmp_path / "large.png", cube(1000, at=(1e4, 0, -1e4)))
    assert abs(small - large).mean() < 3


def test_no_file_where_none_can_be_made(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="does not exist"):
        picture(cube(), tmp_path / "missing" / "cube.png")
    with pytest.raises(RenderError, match="no triangles"):
        picture(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), tmp_path / "empty.png")
    assert list(tmp_path.iterdir()) == []


def test_a_machine_that_cannot_draw_gets_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("import os; os.abort()")
    monkeypatch.setattr("fracslice.viewer.plotter.__file__", str(broken))
    with pytest.raises(RenderError, match="libegl1") as failure:
        picture(cube(), tmp_path / "cube.png")
    assert "\n" not in str(failure.value)
    assert list(tmp_path.iterdir()) == [broken]


def test_a_window_needs_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":424242")
    if not window.has_screen():
        with pytest.raises(RenderError, match="no screen"):
            show(cube())
    assert window.caption(cube()) == "10.0 x 10.0 x 10.0 mm, 12 triangles"


def test_boxes_of_a_check_stand_where_it_found_them(monkeypatch: pytest.MonkeyPatch) -> None:
    plotter, actor = MagicMock(), SimpleNamespace(prop=SimpleNamespace(opacity=1.0))
    monkeypatch.setattr(window, "_plotter", lambda title: plotter)
    monkeypatch.setattr(window, "set_lighting", lambda *given, **more: actor)
    mesh = cube()
    opened = window.ViewerWindow(mesh, "")
    marks = [FeatureBox("island", (-1, -2, 3), (1, 2, 4)), FeatureBox("sealed cavity", (2, 2, 5), (3, 3, 9))]
    opened.add(window.Found(marks, np.array([5.0, 10.0]), np.array([2.0, 1.0])), mesh)
    boxes = [call.args[0].bounds for call in plotter.add_mesh.call_args_list]
    x, y, z = (*mesh.bounds.mean(0)[:2], mesh.bounds[0, 2])
    assert boxes[0] == pytest.approx((x - 1, x + 1, y - 2, y + 2, z + 3, z + 4))
    assert boxes[1] == pytest.approx((x + 2, x + 3, y + 2, y + 3, z + 5, z + 9))
    texts = [call.args[0] for call in plotter.add_text.call_args_list]
    assert texts[-2:] == ["1 island", "1 sealed cavity"]
    ((chart,), _) = plotter.add_chart.call_args
    (line,) = chart.plots("line")
    assert (line.x == [5, 10]).all() and (line.y == [2, 1]).all()
    assert actor.prop.opacity == window.CLEAR
    opened.see_through()
    assert actor.prop.opacity == 1
