"""fracslice fill and fracslice cut."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice.mesh.models import read_mesh
from fracslice.scene import read
from fracslice.volume.parts import LATTICES, cut, filled
from tests.examples import stamped
from tests.mesh import shapes

pytestmark = pytest.mark.once


def status(command: str) -> int:
    return run(command.split())


@pytest.fixture(name="cube")
def cube_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cube of 10 mm from (1, 2, 3) on, and a scene of a cube of 20 mm around the origin."""
    monkeypatch.chdir(tmp_path)
    Path("a.xml").write_text('<scene version="1"><solid size="2cm"><box size="0.5 0.5 0.5"/></solid></scene>')
    return shapes.cube(10, (1, 2, 3)).export(tmp_path / "cube.stl")


@pytest.mark.parametrize(
    ("period", "resolution", "error"), stamped([(8, 41, 0.01), (4, 65, 4e-3)], [(8, 41, 0.01)])
)
def test_a_filled_model_has_a_wall_and_a_share_of_the_rest(
    period: int, resolution: int, error: float, cube: Path
) -> None:
    """Inside is a cube of 8 mm, of whole cells."""
    options = f"--volume-fraction 0.25 --shell 1mm --period {period}mm --resolution {resolution} -q"
    assert status(f"fill cube.stl -o filled.ply --with schwarz_d {options}") in (0, 1)  # cavities are sealed
    mesh = read_mesh("filled.ply")
    np.testing.assert_allclose(mesh.size, 10, rtol=1e-6)
    assert mesh.volume == pytest.approx(1000 - 512 + 0.25 * 512, rel=error)


def test_lengths_are_those_of_the_finished_object(cube: Path) -> None:
    """The same of a scene whose unit is 40 mm, and 20 mm with another size."""
    for size, unit in ((None, 40.0), (10.0, 20.0)):
        made = filled(read("a.xml"), "octet", 0.3, 5.0, 1.0, size)
        lattice = made.root.children[1]
        assert made.unit_mm == pytest.approx(unit) and made.root["shell"] == pytest.approx(1 / unit)
        assert (lattice["kind"], lattice["volume_fraction"]) == ("octet", 0.3)
        assert lattice["period"] == pytest.approx(5 / unit)


def test_two_parts_are_the_whole(cube: Path) -> None:
    assert status("cut cube.stl --plane z=2.5mm -o part.stl --resolution 64 -q") in (0, 1)
    below, above = read_mesh("part-below.stl"), read_mesh("part-above.stl")
    for part, height in ((below, 2.5), (above, 7.5)):
        np.testing.assert_allclose(part.size, (10, 10, height), rtol=1e-6)
        assert part.volume == pytest.approx(100 * height, rel=1e-5)
    assert not Path("part.stl").exists()


def test_a_scene_is_cut_where_its_size_puts_it(cube: Path) -> None:
    for size, height in ((None, 5.0), (40.0, 10.0)):
        below, above = cut(read("a.xml"), 0, height, size)
        assert (below.unit_mm, above.unit_mm) == pytest.approx((80, 80) if size else (40, 40))
        assert below.root.bounds.box.hi[0] == pytest.approx(0.125)
    assert status("cut a.xml --plane x=10mm --size 4cm -o half.stl --resolution 33 -q") in (0, 1)
    np.testing.assert_allclose(read_mesh("half-above.stl").size, (10, 40, 40), rtol=1e-5)


@pytest.mark.parametrize(
    ("command", "line"),
    [
        (
            "cut cube.stl --plane z=20mm",
            "the plane z=20mm misses the solid: expected one from 0mm to 10mm",
        ),
        ("cut cube.stl --plane 9mm", "expected a plane such as z=10mm"),
        ("cut cube.stl --plane z=", "expected 0, or a length such as"),
        ("cut cube.stl", "Missing option '--plane'"),
        ("fill cube.stl --with foam", f"'foam': expected {', '.join(LATTICES)}"),
        ("fill cube.stl --volume-fraction 1.5", "'1.5': expected a number > 0 and < 1"),
        ("fill cube.stl --shell 0", "expected a length above zero"),
        ("fill none.stl", "none.stl: no such file"),
    ],
)
def test_what_is_wrong_is_one_line(
    cube: Path, command: str, line: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert status(f"{command} -o x.stl") == 2
    found = capfd.readouterr().err
    assert line in found and found.count("\n") == 1 and not list(Path().glob("x*"))
