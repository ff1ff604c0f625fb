"""Bodies and cavities: found, kept, dropped, filled, and told of."""

from __future__ import annotations

import time

import numpy as np
import pytest

from fracslice.common.arrays import concatenate
from fracslice.errors import MeshError
from fracslice.formulas import sphere as ball
from fracslice.mesh import Mesh
from fracslice.mesh import shells as surveys
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.contouring import Piece, contour_pieces
from fracslice.mesh.model import Removed, Shells, choose
from fracslice.mesh.shells import Pieces, WholeShells, survey
from fracslice.volume import SignBricks

from .shapes import cube, inverted, sphere

pytestmark = pytest.mark.once


def hollow_and_dust() -> Mesh:
    """A hollow cube of 1000 - 8 mm3, a hollow one of 125 - 1 mm3 in the way of its rays, and two grains."""
    return concatenate(
        [
            inverted(cube(2, at=(3, 3, 3))),
            cube(10),
            cube(5, at=(0, 0, 20)),
            inverted(cube(1, at=(1, 1, 21))),
            cube(0.5, at=(30, 0, 0)),
            cube(0.1, at=(3.9, 3.9, 3.9)),
        ]
    )


def surveyed(mesh: Mesh) -> tuple[Pieces, WholeShells]:
    """A mesh in one piece, and its shells."""
    pieces = Pieces()
    pieces.add(Piece(mesh, np.inf))
    return pieces, survey(pieces, 1.0)


def nested(pieces: Pieces, whole: WholeShells) -> Shells:
    searched = whole.searched(bodies=True)
    rays = {n: whole.rays(n, pieces.mesh(n), pieces.labels(n), searched) for n in range(len(pieces))}
    return whole.nested(searched, rays)[0]


def shells(mesh: Mesh) -> Shells:
    return nested(*surveyed(mesh))


def select(mesh: Mesh, **how: str | float) -> tuple[Mesh, Removed]:
    """The shells that are chosen."""
    pieces, whole = surveyed(mesh)
    stays, removed = choose(nested(pieces, whole), **how)  # type: ignore[arg-type]
    return mesh.selected(stays[whole.of_label][pieces.labels(0)][mesh.triangles[:, 0]]), removed


def test_everything_stays_by_default() -> None:
    mesh = hollow_and_dust()
    kept, removed = select(mesh)
    assert np.array_equal(kept.triangles, mesh.triangles)
    assert removed == Removed()


def test_cavities_belong_to_the_smallest_body_around_them() -> None:
    result = shells(hollow_and_dust())
    assert result.body.tolist() == [1, 1, 2, 2, 4, 5]
    assert result.solid_volumes == pytest.approx([0, 992, 124, 0, 0.125, 0.001])


def test_the_largest_keeps_its_cavity() -> None:
    kept, removed = select(hollow_and_dust(), keep=1)
    assert kept.volume == pytest.approx(992)
    assert removed.bodies == 3
    assert removed.bodies_mm3 == pytest.approx(124 + 0.125 + 0.001)
    assert (removed.cavities, removed.filled_mm3) == (1, 0)
    assert check_mesh(kept).printable


def test_filling_drops_the_inner_shells() -> None:
    kept, removed = select(hollow_and_dust(), keep=1, cavities="fill")
    assert kept.volume == pytest.approx(1000)
    assert removed.filled_mm3 == pytest.approx(8)
    assert len(kept.vertices) == 8


def test_filling_swallows_the_bodies_in_a_cavity() -> None:
    kept, removed = select(hollow_and_dust(), cavities="fill")
    assert check_mesh(kept).printable
    assert kept.volume == pytest.approx(1000 + 125 + 0.125)
    assert removed.bodies == 1


def test_dust() -> None:
    kept, removed = select(hollow_and_dust(), dust_mm3=0.01)
    assert removed.bodies == 1
    assert kept.volume == pytest.approx(992 + 124 + 0.125)
    with pytest.raises(MeshError, match="nothing would be left"):
        select(hollow_and_dust(), dust_mm3=2000)


def test_a_shell_inside_out_is_refused() -> None:
    with pytest.raises(MeshError, match="inside out"):
        shells(concatenate([cube(), inverted(cube(at=(20, 0, 0)))]))


def test_thousands_of_parts_take_no_time() -> None:
    grains = [sphere(0.2, at=(x, y, z), level=1) for x in range(20) for y in range(20) for z in range(10)]
    mesh = concatenate(
        [sphere(50, level=6), *[g.translated((-10, -10, 60)) for g in grains], inverted(sphere(40, level=6))]
    )
    shells(hollow_and_dust())  # compiled by now
    begin = time.perf_counter()
    kept, removed = select(mesh, keep=1)
    assert time.perf_counter() - begin < 3
    assert removed.bodies == 4000
    assert np.isclose(kept.volume, sphere(50, level=6).volume - sphere(40, level=6).volume)


def thin_walls(mesh: Mesh, voxel: float) -> str:
    pieces = Pieces()
    pieces.add(Piece(mesh, np.inf))
    return survey(pieces, voxel).thin_walls(voxel)


def test_bodies_thinner_than_a_voxel_are_pieces_unless_they_are_dust() -> None:
    """The wall of a cube is a third of its side, by volume and area."""
    thick, thin = cube(10), [cube(1, at=(20 + 2 * k, 0, 0)) for k in range(60)]
    assert thin_walls(concatenate([thick, *thin]), 0.33) == ""
    reported = thin_walls(concatenate([thick, *thin]), 0.34)
    assert reported == "walls thinner than a voxel fell to pieces: 60 of 61 bodies, 6% of the material"
    assert thin_walls(concatenate([thick, *thin[:40]]), 0.34) == ""
    assert thin_walls(thin[0], 0.34) == "walls thinner than a voxel have holes, 100% of the material"


def test_components_are_joined_by_a_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes of two children and one node of all: the same shells; a node keeps its outer seams only."""
    bricks = np.stack(np.meshgrid(range(9), range(2), range(2), indexing="ij"), -1).reshape(-1, 3)
    solid = np.zeros((72, 16, 16), np.uint8)
    solid[1:-1, 1:-1, 1:-1] = np.random.default_rng(1).random((70, 14, 14)) < 0.25
    packed = np.packbits(solid.reshape(9, 8, 2, 8, 2, 8), axis=-1, bitorder="little")
    noise = np.ascontiguousarray(packed[..., 0].transpose(0, 2, 4, 1, 3).reshape(-1, 8, 8))
    index = np.arange(len(bricks), dtype=np.int32).reshape(9, 2, 2)
    signs = SignBricks((0.0, 0.0, 0.0), 1.0, (8 * bricks).astype(np.int32), noise, index)
    pieces, made = Pieces(), list[surveys.PieceComponents]()
    for piece in contour_pieces(ball(radius=1.0), signs, most=1):
        pieces.add(piece)
    one = survey(pieces, 1.0)
    join = surveys.joined_components
    monkeypatch.setattr(surveys, "joined_components", lambda of: (made.append(join(of)), made[-1])[1])
    monkeypatch.setattr(surveys, "FAN", 2)
    tree = survey(pieces, 1.0)
    assert len(pieces) == 9 and len(made) == 5 + 3 + 2 + 1
    assert 1 < len(one.volumes) < len(one.of_label)
    for name in ("of_label", "outermost", "first", "piece"):
        assert np.array_equal(getattr(one, name), getattr(tree, name)), name
    assert tree.volumes == pytest.approx(one.volumes) and tree.areas == pytest.approx(one.areas)
    assert not len(made[-1].points) and not len(made[-1].after)
