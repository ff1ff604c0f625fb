"""Formulas that a scene defines: a text of arithmetic, which never runs as a program."""

from __future__ import annotations

import builtins
import pickle
import time
from html import escape
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run
from lxml import etree

from fracslice.errors import SceneError
from fracslice.fields.cpu import compile_scene
from fracslice.fields.definitions import definitions
from fracslice.fields.depth import resolve_depths
from fracslice.fields.devices import reference
from fracslice.formulas import get, mandelbox, orbit
from fracslice.scene import Scene, read, reads, to_xml
from fracslice.scene.manual import OPEN, PATH

pytestmark = pytest.mark.once

STEP = "return scale * ball(fold(w, 1), 0.5) + c"
FILE = f"""<scene version="1">
  <define name="own">
    <parameter name="scale" default="-1.7" least="-3" most="-1.2"/>
    # folds of a box
    {STEP}
  </define>
  <define name="egg" kind="distance" half="1 1 1.3">
    <parameter name="flat" default="0.77"/>
    <parameter name="centre" default="0 0 0"/>
    a, b, c = centre
    r = sqrt((x - a)**2 + (y - b)**2 + (flat * (z - c))**2)
    for k in (1, 2):
        r += 0.0 * k
    return where(r &lt; 0.1, r - 1, max(r, 0) - 1)
  </define>
  <solid size="60mm">{{}}</solid>
</scene>"""


def own(text: str, inside: str = "<own/>", **attributes: str) -> Scene:
    given = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return reads(
        f'<scene version="1">\n<define name="own"{given}>\n{escape(text, quote=False)}\n</define>\n'
        f'<solid size="60mm">{inside}</solid></scene>'
    )


def test_a_defined_step_is_the_same_step_of_the_package() -> None:
    scene = reads(FILE.format('<own iterations="4"/>'))
    p = np.random.default_rng(0).uniform(-3, 3, (3, 500))
    expected = reference(mandelbox(scale=-1.7, inner=0.5, iterations=4))(*p)
    assert np.array_equal(reference(scene.root)(*p), expected)
    for precision, tolerance in (("float64", 1e-12), ("float32", 1e-4)):
        values = compile_scene(scene.root, precision).points(*p)
        assert np.quantile(abs(values - expected), 0.98) < tolerance


def test_a_distance_has_parameters_loops_and_its_box() -> None:
    root = reads(FILE.format('<egg flat="0.5" centre="0.1 0 0"/>')).root
    assert root.bounds.box.hi == (1.0, 1.0, 1.3)
    assert root.distance((0.1, 2.0, 0.0)) == pytest.approx(1.0)
    assert root.distance((0.1, 0.0, 4.0)) == pytest.approx(1.0)


def test_depth_hybrids_and_settings() -> None:
    scene = reads(FILE.format('<orbit><own repeat="2"/><mandelbulb power="2"/></orbit>'))
    assert scene.root.bounds.box.finite
    alone = reads(FILE.format('<own iterations="auto"/>'))
    assert resolve_depths(alone.root, 0.1)["iterations"] > 2
    assert alone.with_values(["own.scale=-2"]).root["scale"] == -2
    with pytest.raises(SceneError, match=r"own.scale=1: expected a number >= -3 and <= -1.2"):
        alone.with_values(["own.scale=1"])
    hybrid = orbit(alone.root.formula(scale=-2), get("julia")(c=(0.1, 0, 0, 0)), iterations=2)
    assert "<define" in to_xml(Scene(hybrid, 30.0))


def test_a_mesh_and_a_picture_of_a_definition(tmp_path: Path) -> None:
    scene, mesh, picture = (tmp_path / name for name in ("own.xml", "own.stl", "own.png"))
    scene.write_text(FILE.format('<union><own iterations="3"/><egg/></union>'))
    assert run(["mesh", str(scene), "-o", str(mesh), "--resolution", "24"]) == 0
    assert run(["render", str(scene), "-o", str(picture), "--size", "32x24", "--samples", "1"]) == 0
    assert mesh.stat().st_size > 1000 and picture.stat().st_size > 100


def test_a_scene_is_written_with_its_definitions() -> None:
    scene = reads(FILE.format("<union><own/><egg/><own scale='-2'/></union>"))
    text = to_xml(scene)
    again = reads(text)
    assert again == scene and again.hash == scene.hash and to_xml(again) == text
    assert [d.name for d in definitions(scene.root)] == ["own", "egg"]
    assert f"    # folds of a box\n    {STEP}\n" in text
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert to_xml(scene.with_values(["own[1].scale=-1.5"])) != text


def test_keys_and_hashes_hold_the_text() -> None:
    one, other = own("return 2 * fold(w, 1) + c"), own("return 3 * fold(w, 1) + c")
    assert one.root != other.root and one.hash != other.hash
    assert resolve_depths(one.root, 0.1).key != resolve_depths(other.root, 0.1).key
    with pytest.raises(SceneError, match="own: expected one definition of this name"):
        Scene(one.root | other.root, 10.0)


def test_scenes_that_define_have_a_schema() -> None:
    text = etree.fromstring(FILE.format('<union><own scale="-2"/><sphere/></union>'))
    assert not etree.RelaxNG(etree.parse(PATH)).validate(text)
    schema = etree.RelaxNG(etree.parse(OPEN))
    assert schema.validate(text), schema.error_log
    assert not schema.validate(etree.fromstring(FILE.format("<sphere radios='1'/>")))
    assert not schema.validate(etree.fromstring(FILE.format("<solid/>")))


HOSTILE = [
    "import os\nreturn w",
    "from os import system\nreturn w",
    "return __import__('os').system('true')",
    "return eval('w')",
    "return exec('w = 1')",
    "return open('/etc/passwd')",
    "return w.__class__.__mro__",
    "return ().__class__.__bases__[0].__subclasses__()",
    "return getattr(w, 'x')",
    "return [w for w in w]",
    "return [x for x in range(10) for y in range(1000000000)][0]",
    "return (lambda: w)()",
    "return f'{w}'",
    "return 'text' + w",
    "return b'w'",
    "return w[0:1]",
    "return {**w}",
    "return fold(*w)",
    "return fold(w, limit=1)",
    "return (v := w)",
    "return w if w else c",
    "return (yield w)",
    "return await_(w)",
    "def f(w):\n    return w\nreturn f(w)",
    "class f:\n    pass\nreturn w",
    "global w\nreturn w",
    "del w\nreturn w",
    "try:\n    w = w\nexcept:\n    w = w\nreturn w",
    "with w:\n    w = w\nreturn w",
    "while 1:\n    w = w\nreturn w",
    "for k in range(1000000000):\n    w = 2 * w\nreturn w",
    "for a in range(99):\n    for b in range(99):\n        w = 2 * w\nreturn w",
    "for a in range(600):\n  for b in range(600):\n    for k in range(600):\n      w = w\nreturn w",
    "".join(f"{'  ' * k}for {'abdefgh'[k]} in (1, 2, 3, 4, 5, 6, 7, 8, 9):\n" for k in range(7))
    + f"{'  ' * 7}w = w\nreturn w",
    "for k in w:\n    w = w\nreturn w",
    "x, y, z = w\nx = (((x**16)**16)**16)**16\nreturn (x, y, z) + c",
    "return 9**9**9**9 * w",
    "return 1e400 * w",
    f"return {'9' * 3000} * w",
    "return (1 << 99999999) * w",
    "return True * w",
    "return None",
    "return ...",
    "assert w\nreturn w",
    "raise w\nreturn w",
    "fold = w\nreturn fold",
    "__builtins__ = w\nreturn w",
    "w.x = 1\nreturn w",
    "w[0] = 1\nreturn w",
    "return raise_whole(w)",
    "return over(w)",
    "return own(w)",
    "orbit(w)\nreturn w",
    "return " + "-" * 3900 + "1",
    "return " + "(" * 1900 + "w" + ")" * 1900,
    "return w" + " + w" * 3000,
    "return w" + " + w" * 900,
    f"return {'(' * 28}w{' + w)' * 28}",
    "w = w",
    "",
    "return x",
    "return (w",
    "return w\\",
    "\treturn w\n  return w",
    "return w; import os",
    "return w # ok\nimport os",
    "ｉｍｐｏｒｔ os\nreturn w",
    "return ｅｖａｌ(w)",
]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_a_hostile_text_is_refused_before_anything_runs(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = builtins.compile

    def watched(source, file, *rest, **more):  # type: ignore[no-untyped-def]
        assert "define own" not in str(file), "compiled before it was checked"
        return compiled(source, file, *rest, **more)

    monkeypatch.setattr(builtins, "compile", watched)
    began = time.process_time()
    with pytest.raises(SceneError, match=r"^scene:\d+: <define> own: .*[^.]$") as raised:
        own(text)
    assert "\n" not in str(raised.value)
    assert time.process_time() - began < 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x, y, z = w\n\nreturn (x, y) + c", "scene:5: <define> own: "),
        (
            "w = fold(w, 1)\nx = w + 1\nreturn w",
            "scene:4: <define> own: .*two points or two numbers",
        ),
        ("x, y = w\nreturn w", "scene:3: <define> own: .*expected 2 values"),
        ("return sqrt(w)", "scene:3: .*expected numbers, found a point"),
        ("return sin(1)", "scene:3: .*expected it to return a point"),
        ("return foold(w, 1)", r"scene:3: .*'foold' is no function here; did you mean fold\?"),
        ("return scael * w", "scene:3: .*'scael' has no value here"),
        ("x, y, z = w\nreturn (x**2.5, y, z)", "scene:4: .*expected a whole exponent from 1 to 16, or 0.5"),
        ("return fold(w)", "scene:3: .*fold takes 2 values, found 1"),
        ("return 0.5 * w + c", "scene:5: <own> has orbits that do not escape"),
    ],
)
def test_a_mistake_is_shown_with_its_line(text: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        own(text)


@pytest.mark.parametrize(
    "text", ["return (x, y, z)", "return x < 1", "return 1", "return fold(x, 1)", "return (x, y) + z"]
)
def test_a_distance_returns_a_number(text: str) -> None:
    with pytest.raises(SceneError, match="scene:3: <define> own: "):
        own(text, kind="distance", half="1 1 1")


@pytest.mark.parametrize(
    "name", ["sphere", "solid", "scene", "parameter", "Own", "for", "fold", "a b", "__own"]
)
def test_names_of_definitions(name: str) -> None:
    define = f'<define name="{name}">return 2 * w + c</define>'
    with pytest.raises(SceneError, match="expected a name"):
        reads(f'<scene version="1">{define}<solid size="1cm"><sphere/></solid></scene>')


@pytest.mark.parametrize("name", ["w", "iterations", "place", "julia", "power"])
def test_names_of_parameters(name: str) -> None:
    with pytest.raises(SceneError, match="expected a"):
        reads(FILE.replace('"scale"', f'"{name}"').format("<own/>"))


@pytest.mark.parametrize(
    "text", ["1e9 * w + 1e9 * c", "(1 / 0) * w + c", "(-1)**0.5 * w + c", "(1e9**16) * w"]
)
def test_what_is_accepted_compiles(text: str) -> None:
    try:
        root = own(f"return {text}").root
    except SceneError:
        return
    assert compile_scene(root.changed(iterations=2)).points(*np.ones((3, 4))).shape == (4,)


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("<define name='own'>" + "&lt;" * 70_000 + "</define>", "a text of more than 65536 characters"),
        ("".join(f"<define name='a{k}'>return 2 * w + c</define>" for k in range(101)), "100 definitions"),
        (
            "<define name='own'>" + "".join(f"<parameter name='a{k}' default='1'/>" for k in range(101)),
            "at most 100 of them in a definition",
        ),
    ],
)
def test_definitions_have_an_end(inside: str, message: str) -> None:
    with pytest.raises(SceneError, match=f"scene:1: <.*{message}"):
        reads(f'<scene version="1">{inside}<solid size="1cm"><sphere/></solid></scene>')


def test_a_shipped_scene_defines_its_formula() -> None:
    from fracslice.scene import library

    assert definitions(read(library.path("own-formula")).root)
