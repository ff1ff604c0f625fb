"""What users of NumPy, trimesh, sdf and notebooks try first: each guess does what it says."""

from __future__ import annotations

import asyncio
import pickle
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import trimesh

import fracslice
from fracslice import (
    Mesh,
    Scene,
    box,
    from_function,
    from_grid,
    from_trimesh,
    from_vdb,
    gyroid,
    make_mesh,
    mandelbulb,
    read,
    render,
    slice_layers,
    sphere,
    sweep,
    torus,
    write,
)
from fracslice.common import cache
from fracslice.errors import Cancelled, FracsliceError, FracsliceWarning, SceneError

pytestmark = pytest.mark.once

BALL, POINTS = sphere(1), np.random.default_rng(4).uniform(-2, 2, (50, 3))
LENGTH = np.linalg.norm(POINTS, axis=1)
SMALL = {"resolution": 32}
VOLUME = 4 / 3 * np.pi


def near(value: float, known: float, share: float = 0.02) -> bool:
    return abs(value - known) < share * known


def length(x: Any, y: Any, z: Any) -> Any:
    return np.sqrt(x * x + y * y + z * z)


def grid(spacing: float = 0.1) -> np.ndarray:
    axis = np.arange(-1.3, 1.3, spacing)
    return np.asarray(length(*np.meshgrid(axis, axis, axis, indexing="ij")) - 1)


def ball_mesh() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(3)


def sampled_function() -> bool:
    cache.warn.cache_clear()
    with pytest.warns(FracsliceWarning, match=r"sampled on a grid; fracslice.formulas.shape makes an exact"):
        mesh = make_mesh(lambda x, y, z: 3 * (length(x, y, z) - 1), **SMALL)
    return near(mesh.volume, VOLUME)


def cancelled_thread() -> bool:
    stop = threading.Event()

    async def main() -> None:
        job = asyncio.create_task(asyncio.to_thread(make_mesh, mandelbulb(), resolution=256, cancel=stop))
        await asyncio.sleep(0.05)
        stop.set()
        await job

    with pytest.raises(Cancelled):
        asyncio.run(main())
    return True


class Tensor:
    """Array of another library, of which only DLPack is known."""

    def __init__(self, values: np.ndarray, device: int = 1) -> None:
        self.values, self.device = values, device

    def __dlpack__(self, **options: Any) -> Any:
        if self.device != 1:
            raise BufferError("on a GPU")
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.device, 0


@pytest.fixture(autouse=True)
def library(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library of tensors, with the name that torch or cupy would have."""
    module: Any = ModuleType("tensors")
    module.from_dlpack = Tensor
    monkeypatch.setitem(sys.modules, "tensors", module)
    monkeypatch.setattr(Tensor, "__module__", "tensors.core")


def through_files(folder: Path) -> Mesh:
    make_mesh(BALL, **SMALL).export(folder / "o.stl")
    return Mesh.load(folder / "o.stl")


def saved_picture(folder: Path) -> bool:
    from PIL import Image

    picture = render(BALL, size=(32, 24), samples=1)
    return all(Image.open(picture.save(folder / f"p{e}")).size == (32, 24) for e in (".png", ".jpg", ".webp"))


GUESSES: dict[str, Callable[[Path], Any]] = {
    "f(points)": lambda _: np.allclose(BALL(POINTS), LENGTH - 1),
    "f(x, y, z)": lambda _: np.allclose(BALL(*POINTS.T), LENGTH - 1),
    "f.distance(points)": lambda _: np.allclose(BALL.distance(POINTS), LENGTH - 1),
    "f.distance(x, y, z)": lambda _: BALL.distance(0, [0, 2], [[1], [3]]).shape == (2, 2),
    "f.gradient(points)": lambda _: np.allclose(BALL.gradient(POINTS), POINTS / LENGTH[:, None], atol=1e-6),
    "f.normals(points)": lambda _: np.allclose(np.linalg.norm(gyroid().normals(POINTS), axis=1), 1),
    "a | b, a & b, a - b": lambda _: ((box() | BALL) & (BALL - torus())).bounds.box.finite,
    "a + (x, y, z)": lambda _: (BALL + (0, 0, 2)).bounds.box.hi[2] == 3,
    "a.scale(2).rotate(30).twist(10)": lambda _: box().scale(2).rotate(30).twist(10).bounds.box.finite,
    "make_mesh(f)": lambda _: near(make_mesh(BALL, **SMALL).volume, VOLUME),
    "make_mesh('menger-sponge')": lambda _: make_mesh("menger-sponge", size=9, resolution=27).size[0] == 9,
    "make_mesh(lambda x, y, z: ...)": lambda _: sampled_function(),
    "make_mesh(array, spacing=)": lambda _: near(make_mesh(grid(), spacing=0.1, **SMALL).volume, VOLUME),
    "make_mesh(array, iso=)": lambda _: near(make_mesh(-grid(), iso=-0.1, **SMALL).size[0], 22),
    "from_grid(array, spacing=, iso=)": lambda _: near(
        from_grid(grid(), 0.1, iso=0.1).bounds.box.size[0], 2.2
    ),
    "from_trimesh(mesh)": lambda _: near(make_mesh(from_trimesh(ball_mesh()), **SMALL).volume, VOLUME),
    "Mesh & gyroid": lambda _: (make_mesh(BALL, **SMALL) & gyroid()).bounds.box.finite,
    "trimesh & shape": lambda _: (ball_mesh() & box()).bounds.box.size == (1, 1, 1),
    "make_mesh(..., faces=500)": lambda _: len(make_mesh(BALL, faces=500, **SMALL).faces) == 500,
    "mesh.simplify(faces=500)": lambda _: len(make_mesh(BALL, **SMALL).simplify(faces=500).faces) == 500,
    "mesh.simplify(tolerance=)": lambda _: make_mesh(BALL, **SMALL).simplify(tolerance=0.01).is_watertight,
    "mesh.export('o.vdb')": lambda to: near(
        make_mesh(from_vdb(make_mesh(BALL, **SMALL).export(to / "o.vdb")), **SMALL).volume, VOLUME
    ),
    "read('o.stl')": lambda to: through_files(to) and isinstance(read(to / "o.stl"), Scene),
    "make_mesh(read('o.stl'))": lambda to: (
        near(through_files(to).volume, VOLUME) and near(make_mesh(read(to / "o.stl"), **SMALL).volume, VOLUME)
    ),
    "Mesh.load('o.stl')": lambda to: near(through_files(to).volume, VOLUME),
    "write(mesh, 'o.ply')": lambda to: write(make_mesh(BALL, **SMALL), to / "o.ply").exists(),
    "Picture.save('p.png')": saved_picture,
    "render(f)": lambda _: render(BALL, size=(32, 24), samples=1)._repr_png_()[:4] == b"\x89PNG",
    "f in a notebook": lambda _: "<img src=" in BALL._repr_html_() and "&lt;sphere" in BALL._repr_html_(),
    "make_mesh(bricks)": lambda _: near(
        make_mesh(make_mesh(BALL, **SMALL).bricks_mm, **SMALL).volume, VOLUME
    ),
    "sweep(scene, {'a.b': range(2, 5)})": lambda _: (
        len([m.volume for m in sweep(mandelbulb(iterations=2), {"mandelbulb.power": range(2, 5)}, **SMALL)])
        == 3
    ),
    "pickle.dumps(f), of a mesh, of a scene": lambda _: (
        pickle.loads(pickle.dumps([BALL, Scene(BALL, 3)])) == [BALL, Scene(BALL, 3)]
        and near(pickle.loads(pickle.dumps(make_mesh(BALL, **SMALL))).volume, VOLUME)
    ),
    "asyncio.to_thread(make_mesh, cancel=)": lambda _: cancelled_thread(),
    "f(torch.tensor)": lambda _: np.allclose(BALL(Tensor(POINTS)).values, LENGTH - 1),
    "np.stack(slices)": lambda _: len(np.stack(slice_layers(BALL, layer=0.2, pixel=0.1))) == 10,
}


@pytest.mark.parametrize("guess", GUESSES)
def test_a_guess_does_what_it_says(guess: str, tmp_path: Path) -> None:
    assert GUESSES[guess](tmp_path)


def test_there_are_35_guesses() -> None:
    assert len(GUESSES) == 35


def test_gradients_are_those_of_the_field_and_normals_of_the_surface() -> None:
    shape = torus(1, 0.3)
    mesh = make_mesh(shape, resolution=64)
    points = mesh.place.units(mesh.corners.mean(1))
    across = mesh.normals / np.linalg.norm(mesh.normals, axis=1, keepdims=True)
    assert ((shape.normals(points) * across).sum(1) > 0.9).all()
    assert shape.gradient(POINTS.astype(np.float32)).dtype == np.float64
    assert (box((2, 2, 2)).normals([[0, 0, 3], [5, 0, 0]]).round(6) == [[0, 0, 1], [1, 0, 0]]).all()


def test_a_function_is_found_wherever_it_is_near_the_origin() -> None:
    for scale in (0.5, 1.0, 40.0):
        found = from_function(lambda x, y, z, s=scale: length(x / s, y / s, z / s) - 0.9, samples=64)
        assert found.bounds.box.size == pytest.approx((1.8 * scale,) * 3, rel=1e-2)
    aside = from_function(lambda x, y, z: length(x - 5, y, z) - 1, ((3.9, -1.1, -1.1), (6.1, 1.1, 1.1)))
    assert aside.bounds.box.lo == pytest.approx((4, -1, -1), abs=1e-3)


def test_a_sweep_of_several_values_makes_all_combinations_lazily() -> None:
    made = sweep(box(), {"box.size": [(1, 1, 1), (2, 1, 1)], "box.round": [0, 0.1]}, resolution=16)
    assert [mesh.size[0] for mesh in made] == [1, 1, 2, 2]
    with pytest.raises(SceneError, match="ball"):
        sweep(box(), {"ball.size": [1]})


def test_an_unbounded_shape_has_elements_and_a_reason_in_a_notebook() -> None:
    shown = gyroid(period=2)._repr_html_()
    assert "&lt;gyroid period=&quot;2&quot;/&gt;" in shown and "<img" not in shown and "<p>" in shown


@pytest.mark.filterwarnings("ignore::fracslice.errors.FracsliceWarning")
@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda _: BALL(1, 2), "expected points, or x, y and z; found 2 values"),
        (lambda _: BALL([[1, 2]]), r"expected an array \[..., 3\], found one of shape \[1, 2\]"),
        (lambda _: BALL("abc"), "expected numbers"),
        (lambda _: BALL(Tensor(POINTS, 2)), "points: expected an array in the memory of the CPU"),
        (lambda _: from_grid(Tensor(grid(), 2)), "expected an array in the memory of the CPU"),
        (lambda _: make_mesh(max), "takes no arrays of x, y and z"),
        (lambda _: make_mesh(lambda x: x), "takes no arrays of x, y and z"),
        (lambda _: make_mesh(lambda x, y, z: x[0]), "expected a number for each point"),
        (lambda _: make_mesh(lambda x, y, z: 1 + 0 * x), "no inside near the origin"),
        (lambda _: make_mesh(lambda x, y, z: z), "or one without end; expected bounds"),
        (lambda _: from_function(length, ((1, 1, 1), (0, 0, 0))), "bounds: expected two corners"),
        (lambda _: make_mesh(BALL, spacing=2), "numbers"),
        (lambda to: render(BALL, size=(8, 8), samples=1).save(to / "p.gif"), "unknown kind of file; known"),
        (lambda to: render(BALL, size=(8, 8), samples=1)[0].save(to / "p.png"), r"found uint8 \[8, 3\]"),
        (lambda to: Mesh.load(to / "none.stl"), "none.stl"),
        (lambda to: read(to / "none.stl"), "no such file"),
    ],
)
def test_wrong_guesses_are_one_line(wrong: Callable[[Path], Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(FracsliceError, match=message) as error:
        wrong(tmp_path)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_every_new_call_is_public() -> None:
    assert {"sweep", "from_function", "from_grid", "from_vdb", "write_vdb"} <= set(fracslice.__all__)
