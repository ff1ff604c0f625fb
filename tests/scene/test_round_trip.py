"""Scene -> XML -> Scene, and the one expression in Python that is the issue's scene."""

from __future__ import annotations

import subprocess
import sys
from functools import reduce

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree

from fracslice.errors import SceneError
from fracslice.formulas import box, mandelbulb, menger, plane, repeat, sphere, torus, transform, twist, union
from fracslice.scene import Print, Scene, reads, scene, to_xml
from fracslice.scene.manual import PATH

from .trees import trees

pytestmark = pytest.mark.once

EXAMPLE = """\
<scene version="1">
  <solid size="80mm">
    <union smooth="0.05">
      <mandelbulb power="8" iterations="auto"/>
      <transform translate="0 0 -1.1" rotate="1 0 0 90" scale="0.4"><menger level="3"/></transform>
      <repeat period="0.5 0.5 0.5" count="3 3 1"><sphere radius="0.2"/></repeat>
    </union>
  </solid>
</scene>
"""


def example() -> Scene:
    return scene(
        union(
            mandelbulb(power=8),
            transform(menger(level=3), translate=(0, 0, -1.1), rotate=(1, 0, 0, 90), scale=0.4),
            repeat(sphere(radius=0.2), period=(0.5, 0.5, 0.5), count=(3, 3, 1)),
            smooth=0.05,
        ),
        size="80mm",
    )


def test_the_python_expression_is_the_xml():
    read = reads(EXAMPLE)
    assert read == example()
    assert read.hash == example().hash
    assert read.size_mm == 80


@given(root=trees(), size=st.floats(1e-6, 1e6))
@settings(max_examples=25, suppress_health_check=list(HealthCheck), deadline=None)
def test_written_scenes_read_back_equal_and_fit_the_schema(root, size):
    scene = Scene(root, size)
    text = to_xml(scene)
    again = reads(text, files_outside=True)
    assert again == scene
    assert (to_xml(again), again.hash) == (text, scene.hash)
    schema = etree.RelaxNG(etree.parse(PATH))
    assert schema.validate(etree.fromstring(text)), (text, schema.error_log)


def test_only_what_differs_is_written():
    assert '<box size="1 2 3"/>' in to_xml(scene(box(size=(1, 2, 3), round=0), size=5))
    assert "<mandelbulb/>" in to_xml(scene(mandelbulb(power=8.0), size=5))


def test_the_hash_is_of_the_content():
    base = example()
    assert base.hash == Scene(base.root, 80.0, "another name").hash
    assert base.hash != scene(base.root, size="81mm").hash
    assert base.hash != base.with_values(["menger.level=4"]).hash
    code = "from fracslice.scene import reads; import sys; print(reads(sys.stdin.read()).hash)"
    other = subprocess.run(
        [sys.executable, "-c", code], input=EXAMPLE, capture_output=True, text=True, check=True
    )
    assert other.stdout.strip() == base.hash


def test_a_scene_is_frozen_and_hashable():
    assert {example(): 1}[example()] == 1
    with pytest.raises(AttributeError):
        example().size_mm = 3


def test_several_elements_are_a_union():
    assert scene(sphere(), box(), size=1) == scene(union(sphere(), box()), size=1)
    inside = reads(
        '<scene version="1"><solid size="1"><twist degrees="9"><box/><torus/></twist></solid></scene>'
    )
    assert inside == scene(twist(union(box(), torus()), degrees=9), size=1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: scene(size=1), "at least one element"),
        (lambda: scene(sphere(), size="0mm"), "size '0mm': expected a length above zero"),
        (lambda: scene(sphere(), size=float("nan")), "size nan: expected a length"),
        (lambda: scene(twist(plane(), degrees=9), size=1), "<twist> expected a solid that is bounded"),
    ],
)
def test_impossible_scenes_are_refused_in_python_too(make, message):
    with pytest.raises(SceneError, match=message):
        make()


def test_a_tree_too_deep_is_refused():
    with pytest.raises(SceneError, match="nested too deeply"):
        reduce(lambda node, _: transform(node), range(5000), sphere())


def test_what_makes_it_printable_is_content() -> None:
    text = (
        '<scene version="1"><solid size="8cm"><sphere/></solid><print drain="0" thickness="0.8mm"/></scene>'
    )
    read = reads(text)
    assert read.printing == Print(drain=0.0, thickness=0.8)
    assert reads(to_xml(read)) == read
    assert read.hash != reads(text.replace("0.8", "0.9")).hash
    assert read.with_values(["print.raft=2mm"]).printing.raft == 2
    for wrong in ('thickness="-1mm"', 'keep="some"', 'keep="largest" bridge="1mm"'):
        with pytest.raises(SceneError, match="<print>"):
            reads(text.replace('drain="0" thickness="0.8mm"', wrong))


def test_a_shape_is_no_scene() -> None:
    with pytest.raises(SceneError, match=r"^sphere\(\): expected a scene, such as Scene\(sphere\(\), 40\)$"):
        to_xml(sphere())  # type: ignore[arg-type]
