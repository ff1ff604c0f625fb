"""--set: every element of a name, the n-th one, or the solid."""

import pytest

from fracslice.errors import SceneError
from fracslice.formulas import box, mandelbulb, sphere, transform, union
from fracslice.scene import scene

SCENE = scene(
    union(transform(box(), translate=(1, 0, 0)), box(size=(2, 2, 2)), mandelbulb(), mandelbulb(power=3)),
    size="80mm",
)


def test_every_element_of_the_name():
    assert [n["power"] for n in matching("mandelbulb", "mandelbulb.power=6")] == [6, 6]


def test_the_nth_element_in_the_order_of_the_file():
    changed = matching("box", "box[2].round=0.25")
    assert [n["round"] for n in changed] == [0, 0.25]
    assert changed[1]["size"] == (2, 2, 2)


def test_the_size_and_several_settings_at_once():
    changed = SCENE.with_values(
        ["solid.size=4cm", " mandelbulb . iterations = auto ", "box.size=1 2 3", "box.size=3 2 1"]
    )
    assert changed.size_mm == 40
    assert [n["size"] for n in changed.root.walk() if n.formula.name == "box"] == [(3, 2, 1)] * 2


def test_an_element_of_the_view_need_not_be_in_the_file():
    view = SCENE.with_values(["camera.eye=3 -2 1", "fog.density=0.5", "film.samples=4"]).view
    assert view.camera and view.camera.eye == (3, -2, 1) and view.fog and view.fog.density == 0.5
    with pytest.raises(SceneError, match="the scene has no <light>"):
        SCENE.with_values(["light.strength=2"])


def test_no_setting_changes_nothing_and_the_original_stays():
    before = SCENE.hash
    assert SCENE.with_values([]) == SCENE
    assert SCENE.with_values(["solid.size=1mm"]).name == SCENE.name
    assert SCENE.hash == before


def test_one_node_used_twice_is_two_elements():
    ball = sphere()
    twice = scene(union(ball, ball), size=1).with_values(["sphere[1].radius=2"])
    assert [n["radius"] for n in twice.root.walk() if n.formula.name == "sphere"] == [2, 1]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "mandelblub.power=6",
            r"mandelblub.power=6: the scene has no <mandelblub>; did you mean <mandelbulb>\?",
        ),
        (
            "julia.c=1 2 3 4",
            "the scene has no <julia>; expected <box>, <mandelbulb>, <solid>, <transform> or <union>",
        ),
        ("mandelbulb.pwer=6", r"<mandelbulb> has no attribute 'pwer'; did you mean power\?"),
        ("mandelbulb.power=six", "mandelbulb.power=six: expected a number >= 2 and <= 32"),
        ("mandelbulb.power=nan", "expected a number >= 2"),
        ("mandelbulb.power=", "expected a number >= 2"),
        ("mandelbulb[3].power=6", "the scene has 2 <mandelbulb>, counted from 1"),
        ("mandelbulb[0].power=6", "counted from 1"),
        ("solid.size=0", "solid.size=0: expected a length above zero"),
        ("solid.sise=4", "did you mean size"),
        ("box.round=3", "<box> round=3: expected at most half the shortest edge"),
        ("power=6", "'power=6': expected ELEMENT.ATTRIBUTE=VALUE"),
        ("", "expected ELEMENT.ATTRIBUTE=VALUE"),
    ],
)
def test_bad_settings_say_what_is_expected(override, message):
    with pytest.raises(SceneError, match=message) as caught:
        SCENE.with_values([override])
    assert "\n" not in str(caught.value)


def matching(name, *settings):
    return [node for node in SCENE.with_values(settings).root.walk() if node.formula.name == name]
