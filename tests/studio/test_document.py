"""Edits of a scene's text: what they leave as it was, and that every one of them can be undone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.scene import library
from fracslice.studio.document import Document, Place, parse
from fracslice.studio.panels import outline
from tests.examples import stamped

pytestmark = pytest.mark.once

TEXT = """<scene version="1">
  <!-- A ball — and a box. -->
  <solid size="40mm">
    <union  smooth='0.1'>
      <sphere radius="0.5"/>  <!-- round -->
      <transform translate="1 0 0"><box size="1 1 1"/></transform>
    </union>
  </solid>
</scene>
"""
BALL, MOVED, BOX = (0, 0, 0), (0, 0, 1), (0, 0, 1, 0)


@pytest.fixture
def document(tmp_path: Path) -> Document:
    return Document(TEXT, tmp_path / "two.xml")


def test_the_elements_have_their_places(document: Document) -> None:
    tags = {tag.place: tag for tag in document.root.walk()}
    assert {place: tag.name for place, tag in tags.items()} == {
        (): "scene",
        (0,): "solid",
        (0, 0): "union",
        BALL: "sphere",
        MOVED: "transform",
        BOX: "box",
    }
    for tag in tags.values():
        assert TEXT[tag.start :].startswith(f"<{tag.name}") and TEXT[tag.end - 1] == ">"
    assert TEXT[tags[MOVED].start : tags[MOVED].end].count("\n") == 0
    assert tags[BALL].line == 5 and document.version.at == (0, 0)


def test_a_value_changes_its_own_characters_alone(document: Document) -> None:
    document.set_value((0, 0), "smooth", "0.2")
    assert document.text == TEXT.replace("'0.1'", '"0.2"')
    document.set_value(BOX, "round", "0.1")
    document.set_value(BALL, "radius", None)
    assert document.text == TEXT.replace("'0.1'", '"0.2"').replace(
        '1 1 1"/>', '1 1 1" round="0.1"/>'
    ).replace(' radius="0.5"', "")
    assert document.scene.root["smooth"] == 0.2


def test_moves_of_a_slider_are_one_edit(document: Document) -> None:
    for value in np.linspace(0.5, 0.9, 20):
        document.set_value(BALL, "radius", f"{value:.3g}")
    document.set_value(BALL, "radius", "0.95")
    assert document.undoes == 1
    document.undo()
    assert document.text == TEXT
    document.redo()
    assert 'radius="0.95"' in document.text and document.redoes == 0


def test_elements_are_added_wrapped_moved_and_removed(document: Document) -> None:
    document.add((0, 0), "torus")
    assert document.find((0, 0, 2)).name == "torus"  # type: ignore[union-attr]
    document.wrap(BALL, "twist")
    assert document.find((*BALL, 0)).name == "sphere" and "<!-- round -->" in document.text  # type: ignore[union-attr]
    document.unwrap(BALL)
    document.move((0, 0, 2), BALL)
    assert [tag.name for tag in document.find((0, 0)).children] == ["torus", "sphere", "transform"]  # type: ignore[union-attr]
    assert document.version.at == BALL
    document.remove(BALL)
    assert document.text == TEXT
    document.duplicate(BOX)
    assert document.problem == "" and document.find((0, 0, 1)).children[1].name == "box"  # type: ignore[union-attr]
    while document.undoes:
        document.undo()
    assert document.text == TEXT


def test_an_invalid_text_leaves_the_last_scene(document: Document) -> None:
    scene = document.scene
    document.write(TEXT.replace("sphere", "spheres"))
    assert document.scene is scene and document.problem.startswith("two.xml:5: <spheres>")
    document.write(TEXT[:-5])
    assert "two.xml:9" in document.problem and "not well-formed" in document.problem
    document.set_value((0,), "size", "50mm")  # at its place in the last well-formed text
    document.undo()
    document.undo()
    document.undo()
    assert document.text == TEXT and document.problem == ""


def test_what_is_no_edit_is_refused(document: Document) -> None:
    for edit in (
        lambda: document.remove(()),
        lambda: document.remove((0, 0, 7)),
        lambda: document.unwrap(BALL),
        lambda: document.move(MOVED, BOX),
    ):
        with pytest.raises(SceneError):
            edit()
    assert document.text == TEXT
    with pytest.raises(SceneError, match="document types"):
        parse('<!DOCTYPE a [<!ENTITY b "c">]><a/>')


EDITS = ("set", "add", "wrap", "unwrap", "duplicate", "move", "remove")


@pytest.mark.parametrize("seed", stamped(range(200), range(8)))
def test_any_edits_can_be_undone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    names = library.names()
    path = library.path(names[seed % len(names)])
    document = Document(path.read_text(encoding="utf-8"), path)
    texts = [document.text]
    for _ in range(100):
        places: list[Place] = [tag.place for tag in document.root.walk() if len(tag.place) > 1]
        if not places:
            break
        place, other = (places[rng.integers(len(places))] for _ in range(2))
        try:
            match EDITS[rng.integers(len(EDITS))]:
                case "set":
                    document.set_value(place, "smooth", f"{rng.integers(9)}")
                case "add":
                    document.add(place, "sphere")
                case "wrap":
                    document.wrap(place, "transform")
                case "move":
                    document.move(place, other)
                case name:
                    getattr(document, name)(place)
        except SceneError:
            continue
        parse(document.text)
        if document.undoes >= len(texts):
            texts.append(document.text)
        else:
            texts[document.undoes] = document.text
    for text in reversed(texts):
        assert document.text == text
        document.undo()
    for text in texts:
        assert document.text == text
        document.redo()


def test_an_element_is_turned_off_and_on_again(tmp_path: Path) -> None:
    text = """<scene version="1">
  <solid size="1mm">
    <sphere radius="1"/>
    <transform translate="2 0 0"><box/></transform>
  </solid>
</scene>
"""
    document = Document(text, tmp_path / "two.xml")
    document.turn_off((0, 0))
    assert not document.problem and document.scene.root.formula.name == "transform"
    (row,) = (row for row in outline(document) if row["off"])
    assert (row["name"], row["place"], row["depth"]) == ("sphere", [0], 1)
    assert [row["name"] for row in outline(document)] == ["solid", "sphere", "transform", "box"]
    document.turn_on(row["start"])
    assert document.text == text and document.version.at == (0, 0)
    with pytest.raises(SceneError, match="turned off"):
        document.turn_on(3)
    document.set_value((0, 1), "translate", "2 0 0")
    document.wrap((0, 1), "shell")
    document.write(document.text.replace("<box/>", "<!-- why --><box/>"))
    with pytest.raises(SceneError, match="comment inside"):
        document.turn_off((0, 1))
