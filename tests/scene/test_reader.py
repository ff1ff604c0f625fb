"""Every way a scene file can be wrong ends in one line with file, line and what is expected."""

from __future__ import annotations

import os
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fracslice.errors import SceneError
from fracslice.formulas import sphere
from fracslice.scene import read, reads, scene

BALL = "<sphere/>"


def around(inside: str, size: str = "80mm") -> str:
    return f'<scene version="1">\n<solid size="{size}">\n{inside}\n</solid>\n</scene>'


def refused(text: str | bytes) -> str:
    with pytest.raises(SceneError) as caught:
        reads(text, "f.xml")
    message = str(caught.value)
    assert message.isprintable(), "one line"
    return message


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("<mandelblub/>", "f.xml:3: <mandelblub> is not a known element; did you mean <mandelbulb>?"),
        (
            "<coral/>",
            'f.xml:3: <coral> is not a known element; "fracslice formulas" lists them, --formulas FILE',
        ),
        ("<Sphere/>", "f.xml:3: <Sphere> is not a known element; did you mean <sphere>?"),
        (
            "<mandelbulb pwer='3'/>",
            'f.xml:3: <mandelbulb> pwer="3": is not an attribute of it; did you mean power?',
        ),
        ("<sphere\n\n  radius='x'/>", 'f.xml:3: <sphere> radius="x": expected a number > 0'),
        (
            "<union>\n<box/>\n<sphere radius='nan'/></union>",
            'f.xml:5: <sphere> radius="nan": expected a number > 0',
        ),
        ("<sphere radius='inf'/>", 'f.xml:3: <sphere> radius="inf": expected a number > 0'),
        ("<sphere radius='1e999'/>", 'f.xml:3: <sphere> radius="1e999": expected a number > 0'),
        ("<sphere radius='-1'/>", 'f.xml:3: <sphere> radius="-1": expected a number > 0'),
        ("<sphere radius='0'/>", 'f.xml:3: <sphere> radius="0": expected a number > 0'),
        ("<sphere radius='1_0'/>", 'f.xml:3: <sphere> radius="1_0": expected a number > 0'),
        ("<sphere radius='٣'/>", 'f.xml:3: <sphere> radius="٣": expected a number > 0'),
        ("<sphere radius=''/>", 'f.xml:3: <sphere> radius="": expected a number > 0'),
        ("<menger level='3.5'/>", 'f.xml:3: <menger> level="3.5": expected a whole number from 0 to 20'),
        ("<menger level='1_0'/>", 'f.xml:3: <menger> level="1_0": expected a whole number from 0 to 20'),
        ("<box size='1 2'/>", 'f.xml:3: <box> size="1 2": expected 3 numbers > 0'),
        (
            "<box size='1,2,3'/>",
            'f.xml:3: <box> size="1,2,3": expected 3 numbers > 0, separated by spaces',
        ),
        ("<mirror axis='w'><box/></mirror>", 'f.xml:3: <mirror> axis="w": expected x, y or z'),
        (
            "<repeat><box/></repeat>",
            'f.xml:3: <repeat> needs the attribute period="...": expected 3 numbers > 0',
        ),
        ("<box round='3'/>", "f.xml:3: <box> round=3: expected at most half the shortest edge, 0.5"),
        (
            "<twist degrees='9'><plane/></twist>",
            "f.xml:3: <twist> expected a solid that is bounded across the z axis",
        ),
        (
            "<transform scale='0'><box/></transform>",
            'f.xml:3: <transform> scale="0": expected a map that does not',
        ),
        (
            "<bend degrees='5e-324'><box/></bend>",
            "f.xml:3: <bend> has numbers too large or too small to compute with",
        ),
        (
            "<transform scale='1e308'><sphere radius='10'/></transform>",
            'f.xml:3: <transform> scale="1e308": expected 1 or 3 numbers, of a size from 1e-15 to 1e+09',
        ),
        (
            "<sphere radius='1e10'/>",
            'f.xml:3: <sphere> radius="1e10": expected a number > 0, of a size from 1e-15 to 1e+09',
        ),
        ("<cone radius='1e-200'/>", 'f.xml:3: <cone> radius="1e-200": expected a number > 0, of a size from'),
        ("<repeat period='.1 1 1'><box/></repeat>", "f.xml:3: <repeat> period: expected at least a sixth"),
        ("<union/>", "f.xml:3: <union> takes at least 1 element inside it, found 0"),
        ("<shell thickness='1'/>", "f.xml:3: <shell> takes at least 1 element inside it, found 0"),
        ("<box>\n<sphere/></box>", "f.xml:3: <box> takes no elements inside it, found <sphere>"),
        ("<box/>\nmore", "f.xml:2: <solid> holds the text 'more': expected elements only"),
        ("", "f.xml:2: <solid> expected at least one element inside it"),
        (
            "<solid size='1mm'><box/></solid>",
            'f.xml:3: <solid> cannot stand here; "fracslice formulas" lists',
        ),
        ("<box>", "f.xml:4: not well-formed XML: mismatched tag"),
        ("<box size='1 1 1' size='1 1 1'/>", "f.xml:3: not well-formed XML: duplicate attribute"),
        ("<box", "f.xml:4: not well-formed XML"),
        ("&nothing;", "f.xml:3: not well-formed XML: undefined entity"),
        ("<xi:include href='/etc/hostname'/>", "f.xml:3: <xi:include> is not a known element"),
        ("<transform>" * 120, "f.xml:3: <transform> is nested too deeply: expected at most 100 elements"),
    ],
)
def test_wrong_content(inside, message):
    assert refused(around(inside)).startswith(message)


@pytest.mark.parametrize("size", ["0mm", "0", "-1mm", "nan", "inf", "1e9", "80 furlongs", "eighty", ""])
def test_wrong_sizes(size):
    assert refused(around(BALL, size)).startswith(
        f'f.xml:2: <solid> size="{size}": expected a length above zero such as 80mm'
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "f.xml: expected a scene, the file is empty"),
        (" \n ", "f.xml: expected a scene, the file is empty"),
        ("solid ascii\nfacet", "f.xml: not a scene: expected XML that begins with"),
        (b"\x00\x01\xff", "f.xml: not a scene: expected XML that begins with"),
        ("<scne version='1'/>", "f.xml:1: <scne> is not a known element; did you mean <scene>?"),
        ("<solid size='1'><box/></solid>", "f.xml:1: <solid> cannot stand here; expected <scene>"),
        (
            "<scene><solid size='1'><box/></solid></scene>",
            'f.xml:1: <scene> needs the attribute version="...": expected 1',
        ),
        ("<scene version='2'/>", 'f.xml:1: <scene> version="2": expected 1'),
        ("<scene version='1'/>", "f.xml:1: <scene> expected <solid> inside it"),
        (
            "<scene version='1'><box/></scene>",
            "f.xml:1: <box> cannot stand here; "
            "expected <animation>, <camera>, <define>, <film>, <fog>, <light>, <print>, <shading>, <solid> "
            "or <track>",
        ),
        (
            "<scene version='1'><solid size='4cm' unit='1mm'><box/></solid></scene>",
            "f.xml:1: <solid> size and unit: expected one of them",
        ),
        (
            around(BALL).replace("</scene>", "<solid size='1'><box/></solid></scene>"),
            "f.xml:5: <solid> may only stand once",
        ),
        (around(BALL) + around(BALL), "f.xml:5: not well-formed XML: junk after document element"),
        (
            '<?xml version="1.0" encoding="klingon"?><a/>',
            "f.xml:1: cannot decode the file: unknown encoding: klingon",
        ),
    ],
)
def test_wrong_files(text, message):
    assert refused(text).startswith(message)


LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 12))


@pytest.mark.parametrize(
    "declared",
    [
        f'<!ENTITY l0 "lol">{LAUGHS}',
        '<!ENTITY x SYSTEM "file:///etc/hostname">',
        '<!ENTITY % x SYSTEM "http://localhost:1/x.dtd"> %x;',
        "",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_document_types_are_refused_before_anything_is_expanded(declared, encoding):
    text = f'\n<!DOCTYPE scene [{declared}]>\n<scene version="1"><solid size="&l11;"><box/></solid></scene>'
    started = time.perf_counter()
    message = refused(text.encode(encoding))
    assert message == "f.xml:2: <!DOCTYPE>: document types and entities are not allowed in a scene"
    assert time.perf_counter() - started < 1


def test_a_solid_without_size_has_units_of_a_millimetre():
    read = reads("<scene version='1'><solid><box/></solid></scene>", "f.xml")
    assert (read.size_mm, read.unit_mm) == (None, 1.0)


def test_a_long_or_odd_value_is_still_one_short_line():
    message = refused(around(f"<sphere radius='&#10;{'9' * 5000}x'/>"))
    assert len(message) < 150


def test_comments_instructions_encodings_and_character_references_are_fine():
    text = '<?xml version="1.0"?><?xml-model href="scene.rng"?><!-- a ball -->' + around(
        "<!-- it --><sphere radius='&#49;'/>"
    )
    assert reads(text) == reads(text.encode("utf-16")) == scene(sphere(), size=80)


def test_files_that_cannot_be_read(tmp_path):
    big = tmp_path / "big.xml"
    big.write_bytes(b" " * ((64 << 20) + 1))
    (layers := tmp_path / "layers.sl1").write_bytes(b"PK" + big.read_bytes())
    for path, message in [
        (tmp_path / "none.xml", "No such file"),
        (tmp_path, "Is a directory"),
        (big, "at most 64 MB"),
        (layers, "not a scene"),
        (tmp_path / ("x" * 5000), "File name too long"),
    ]:
        with pytest.raises(SceneError, match=message):
            read(path)


@pytest.mark.parametrize(("count", "encoding"), [(10**6, "utf-8"), (10**5 * 6, "utf-16")])
def test_a_scene_of_a_million_shapes_is_refused_before_one_is_made(count, encoding):
    data = around(f"<union>{'<sphere/>' * count}</union>").encode(encoding)
    began = time.process_time()
    with pytest.raises(SceneError, match="at most 524,288 elements"):
        reads(data)
    assert time.process_time() - began < 1


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission(tmp_path):
    path = tmp_path / "secret.xml"
    path.write_text(around(BALL))
    path.chmod(0)
    with pytest.raises(SceneError, match="Permission denied"):
        read(path)


def test_a_scene_is_named_after_its_file(tmp_path):
    path = tmp_path / "ball.xml"
    path.write_text(around(BALL))
    assert read(path).name == "ball"
    assert read(str(path)).root.place == f"{path}:3"


@given(st.text(alphabet=st.characters(codec="utf-8"), max_size=200) | st.binary(max_size=200))
def test_noise_is_refused_in_one_line(noise):
    refused(noise)


@given(st.data())
def test_a_damaged_file_is_read_or_refused_in_one_line(data):
    text = around("<union smooth='0.1'><sphere radius='0.5'/><box size='1 2 3' round='.1'/></union>")
    at = data.draw(st.integers(0, len(text)))
    damage = data.draw(st.text(alphabet="<>/='\" 0-.e&;xa", max_size=4))
    try:
        message = repr(reads(text[:at] + damage + text[at + data.draw(st.integers(0, 5)) :]))
    except SceneError as error:
        message = str(error)
    assert message.isprintable()
