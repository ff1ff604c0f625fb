"""What is made from the registry is committed; it must be what the registry says today."""

from pathlib import Path

import pytest
from lxml import etree

from fracslice.formulas import names
from fracslice.scene.manual import PATH, markdown, relaxng

DOCS = Path(__file__).parents[2] / "docs/reference/elements.md"


def test_the_committed_schema_is_the_generated_one():
    assert PATH.read_text(encoding="utf-8") == relaxng(), "run: python docs/generate.py"


def test_the_committed_documentation_is_the_generated_one():
    assert DOCS.read_text(encoding="utf-8").endswith("\n\n" + markdown()), "run: python docs/generate.py"


def test_every_formula_is_documented():
    text = markdown()
    assert [name for name in names() if f"### `<{name}>`" not in text] == []


@pytest.mark.parametrize(
    "inside",
    [
        "<sphere radius='0'/>",
        "<sphere radius='NaN'/>",
        "<plane offset='INF'/>",
        "<plane offset='-INF'/>",
        "<spere/>",
        "<sphere radios='1'/>",
        "<mandelbulb iterations='much'/>",
        "<mandelbulb power='33'/>",
        "<julia c='1 2 3'/>",
        "<mirror axis='w'><box/></mirror>",
        "<mirror><box/></mirror>",
        "<union/>",
        "<box><sphere/></box>",
        "",
        "<repeat period='1 1 1' count='1 1 -1'><sphere/></repeat>",
        "<repeat period='1 1 1' count='1 1 .5'><sphere/></repeat>",
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(inside):
    schema = etree.RelaxNG(etree.parse(PATH))
    frame = '<scene version="1"><solid size="8cm">{}</solid></scene>'
    assert schema.validate(etree.fromstring(frame.format("<sphere/>")))
    assert not schema.validate(etree.fromstring(frame.format(inside)))
