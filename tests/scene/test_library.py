import pytest

from fracslice.errors import SceneError
from fracslice.scene import library, read


def test_shipped_scenes_are_found_by_name():
    assert "mandelbulb" in library.names()
    assert read(library.path("mandelbulb")).name == "mandelbulb"
    assert read(library.path("dusk")).name == "dusk" and not {*library.names()} & {*library.gallery()}


def test_an_unknown_name_gets_the_nearest_right_one():
    with pytest.raises(SceneError, match=r"mandelblub: no such scene; did you mean mandelbulb\?"):
        library.path("mandelblub")


def test_a_name_is_not_a_path():
    with pytest.raises(SceneError, match="no such scene"):
        library.path("../scenes/mandelbulb")
