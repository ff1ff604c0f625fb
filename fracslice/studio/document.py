"""The text of a scene as a tree that can be edited: an edit changes the characters of one element, so that
comments and formatting stay; every edit can be undone.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from xml.parsers import expat

from ..common.parameters import REQUIRED, Choice, File, Parameter, printable
from ..errors import SceneError
from ..fields.node import FORMULAS
from ..records import Part
from ..scene.layout import SCENE, SECTIONS, SOLID, Element
from ..scene.model import Scene, part_to_xml
from ..scene.reader import let_go, reads

Place = tuple[int, ...]
"""Numbers of the children that lead from `<scene>`, which is (), to an element."""

INDENT = "  "

MOST = 1000
"""Edits that can be undone."""

SOON = 1.0
"""Time within which equal edits are one, such as the moves of a slider, seconds."""

MARK = "\ufdd0"
"""No character: stands where an element will be."""


OFF = re.compile(r"<!--off (.*) off-->", re.DOTALL)
"""Comment that an element is which is turned off."""


@dataclass(frozen=True)
class Off:
    """An element that is turned off. Positions are those of characters of its comment."""

    name: str
    above: Place  # element that it is in
    start: int
    end: int


@dataclass
class Tag:
    """An element of the text. Positions are those of characters."""

    name: str
    attributes: Mapping[str, str]
    place: Place
    line: int  # from 1
    start: int  # of its start tag
    inner: int  # end of its start tag
    close: int = 0  # start of its end tag; that of its start tag if it has none
    end: int = 0
    children: list[Tag] = field(default_factory=list)
    off: list[Off] = field(default_factory=list)  # elements inside that are turned off

    @property
    def is_empty(self) -> bool:
        """True for an element without an end tag."""
        return self.inner == self.end

    def walk(self) -> Iterator[Tag]:
        """This element and all inside it, in the order of the text."""
        yield self
        for child in self.children:
            yield from child.walk()


def parse(text: str) -> Tag:
    """Parse the elements of a text.

    Raises
    ------
    SceneError
        If it is not well-formed: "line: message".
    """
    data, parser = text.encode(), expat.ParserCreate()
    characters = _Characters(data)
    top = Tag("", {}, (), 0, 0, 0)
    opened = [top]

    def start(name: str, attributes: dict[str, str]) -> None:
        above, begin = opened[-1], parser.CurrentByteIndex
        place = (*above.place, len(above.children)) if above is not top else ()
        first, last = characters.at(begin), characters.at(_end_of_tag(data, begin))
        tag = Tag(name, attributes, place, parser.CurrentLineNumber, first, last)
        above.children.append(tag)
        opened.append(tag)

    def end(_: str) -> None:
        tag, begin = opened.pop(), characters.at(parser.CurrentByteIndex)
        closed = text[tag.inner - 2 : tag.inner] != "/>"
        tag.close = begin if closed else tag.start
        tag.end = text.index(">", begin) + 1 if closed else tag.inner

    def comment(data: str) -> None:
        begin = characters.at(parser.CurrentByteIndex)
        if found := OFF.match(f"<!--{data}-->"):
            name = (re.match(r"<(\w+)", found[1]) or ("", "?"))[1]
            opened[-1].off.append(Off(name, opened[-1].place, begin, text.index("-->", begin) + 3))

    def doctype(*_: object) -> None:
        raise SceneError(f"{parser.CurrentLineNumber}: document types are not allowed in a scene")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler, parser.CommentHandler = doctype, comment
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise SceneError(f"{error.lineno}: not well-formed XML: {expat.ErrorString(error.code)}") from None
    finally:
        let_go(parser)
    return top.children[0]


class _Characters:
    """Numbers of the characters at bytes of a text, asked for in ascending order or from any before."""

    def __init__(self, data: bytes) -> None:
        self._data, self._byte, self._character = data, 0, 0

    def at(self, byte: int) -> int:
        """Number of the character that begins at a byte."""
        if byte < self._byte:
            self._byte = self._character = 0
        self._character += len(self._data[self._byte : byte].decode())
        self._byte = byte
        return self._character


def _end_of_tag(data: bytes, start: int) -> int:
    """End of the start tag that begins at a byte."""
    quote = 0
    for at in range(start, len(data)):
        byte = data[at]
        if quote:
            quote = 0 if byte == quote else quote
        elif byte in b"'\"":
            quote = byte
        elif byte == ord(">"):
            return at + 1
    return len(data)


@dataclass(frozen=True)
class Version:
    """A state of a document."""

    text: str
    at: Place  # element that is chosen
    what: str = ""  # edit that led to it; an equal one that soon follows takes its place
    when: float = 0.0  # of that edit, s


class Document:
    """A scene as text, with its elements, its problem if it is invalid, and its former versions.

    Parameters
    ----------
    text : str
        XML.
    path : Path
        File of the scene; other files lie beside it.
    files_outside : bool
        Whether models may lie outside of its folder.

    Raises
    ------
    SceneError
        If the text is no valid scene.
    """

    def __init__(self, text: str, path: Path, files_outside: bool = False) -> None:
        self.path, self._files_outside = path, files_outside
        self.root, self.scene, self.problem = parse(text), self._read(text), ""
        self._versions, self._now, self.saved = [Version(text, self._first())], 0, text

    def _first(self) -> Place:
        """Place of the first element of the solid."""
        solid = next((tag for tag in self.root.children if tag.name == SOLID.name), self.root)
        return solid.children[0].place if solid.children else solid.place

    def _read(self, text: str) -> Scene:
        made = reads(text, str(self.path), files_outside=self._files_outside)
        return replace(made, name=printable(self.path.stem))

    @property
    def version(self) -> Version:
        """The version that stands."""
        return self._versions[self._now]

    @property
    def text(self) -> str:
        """The text that stands, valid or not."""
        return self.version.text

    @property
    def chosen(self) -> Tag | None:
        """The element that is chosen, if the text has it."""
        return self.find(self.version.at)

    @property
    def is_saved(self) -> bool:
        """True if the file has this text."""
        return self.text == self.saved

    @property
    def undoes(self) -> int:
        """Number of edits that can be undone."""
        return self._now

    @property
    def redoes(self) -> int:
        """Number of undone edits that can be made again."""
        return len(self._versions) - 1 - self._now

    def find(self, place: Place) -> Tag | None:
        """The element at a place of the last well-formed text."""
        tag = self.root
        for number in place:
            if number >= len(tag.children):
                return None
            tag = tag.children[number]
        return tag

    def choose(self, place: Place) -> None:
        """Choose an element; this is no edit."""
        if self.find(place) is not None:
            self._versions[self._now] = replace(self.version, at=place, what="")

    def write(self, text: str, at: Place | None = None, what: str = "") -> None:
        """Replace the whole text.

        `what`: name of the edit; if the one just before has the same, both are undone together.
        """
        if text == self.text:
            return
        del self._versions[self._now + 1 :]
        made = Version(text, self.version.at if at is None else at, what, time.monotonic())
        if what and what == self.version.what and made.when - self.version.when < SOON:
            self._versions[self._now] = made
        else:
            self._versions.append(made)
            del self._versions[: -MOST - 1]
        self._now = len(self._versions) - 1
        self._look()

    def undo(self) -> None:
        """Return to the version before."""
        self._turn(self._now - 1)

    def redo(self) -> None:
        """Make the edit again that was undone last."""
        self._turn(self._now + 1)

    def _turn(self, number: int) -> None:
        if 0 <= number < len(self._versions):
            self._now = number
            self._look()

    def _look(self) -> None:
        """Read the text; an invalid one leaves the last valid scene."""
        try:
            self.root = parse(self.text)
        except SceneError as error:
            self.problem = f"{self.path.name}:{error}"
            return
        try:
            self.scene, self.problem = self._read(self.text), ""
        except SceneError as error:
            self.problem = str(error).replace(str(self.path), self.path.name)

    def set_value(self, place: Place, attribute: str, value: str | None) -> None:
        """Give an attribute a value, or take it away."""
        tag = self._at(place)
        start = with_attribute(self.text[tag.start : tag.inner], attribute, value)
        text = self.text[: tag.start] + start + self.text[tag.inner :]
        self.write(text, place, f"{attribute} of {place}")

    def add(self, place: Place, name: str) -> None:
        """Add an element: inside another that takes any more, else behind it."""
        tag = self._at(place) if place else self.root
        if not self._takes_more(tag):
            return self._insert(place[:-1], place[-1] + 1, empty_element(name))
        return self._insert(place, len(tag.children), empty_element(name))

    def wrap(self, place: Place, name: str) -> None:
        """Put an element around another."""
        tag = self._at(place)
        old, indent = self.text[tag.start : tag.end], self._indent(tag)
        inner = f"{indent}{INDENT}{old.replace(chr(10), chr(10) + INDENT)}"
        new = f"{empty_element(name)[:-2]}>\n{inner}\n{indent}</{name}>"
        self.write(self.text[: tag.start] + new + self.text[tag.end :], place)

    def part(self, name: str) -> Tag | None:
        """The first element of a name beside the solid."""
        return next((tag for tag in self.root.children if tag.name == name), None)

    def append(self, line: str) -> None:
        """Add an element at the end of the scene."""
        end = self.root.close
        self.write(f"{self.text[:end]}{INDENT}{line}\n{self.text[end:]}")

    def write_part(self, part: Part) -> None:
        """Write a record of what a scene has once, such as its camera."""
        line, tag = part_to_xml(part), self.part(part.element)
        if tag is None:
            self.append(line)
        else:
            self.write(self.text[: tag.start] + line + self.text[tag.end :])

    @contextmanager
    def one_edit(self) -> Iterator[None]:
        """Undo what is edited in a block together; the chosen element stays. If it fails, nothing is done."""
        before, versions, at = self._now, [*self._versions], self.version.at
        try:
            yield
        except SceneError:
            self._versions, self._now = versions, before
            self._look()
            raise
        if self._now > before + 1:
            self._versions[before + 1 :] = [self.version]
            self._now = before + 1
        self._versions[self._now] = replace(self.version, at=at)

    def unwrap(self, place: Place) -> None:
        """Leave only what is inside an element."""
        tag = self._at(place)
        inside = self.text[tag.inner : tag.close].strip("\n").strip() if tag.children else ""
        if not inside:
            raise SceneError(f"<{tag.name}> has nothing inside it")
        kept = inside.replace("\n" + INDENT, "\n")
        self.write(self.text[: tag.start] + kept + self.text[tag.end :], place)

    def remove(self, place: Place) -> None:
        """Remove an element, with its line if that holds nothing else."""
        tag = self._at(place)
        start, end = self._lines_of(tag)
        above = place[:-1] if place[-1] == 0 else (*place[:-1], place[-1] - 1)
        self.write(self.text[:start] + self.text[end:], above)

    def turn_off(self, place: Place) -> None:
        """Make an element a comment, which can be turned on again."""
        tag = self._at(place)
        old = self.text[tag.start : tag.end]
        if "--" in old:
            raise SceneError(f"<{tag.name}>: has a comment inside it, and cannot become one; remove it first")
        self.write(f"{self.text[: tag.start]}<!--off {old} off-->{self.text[tag.end :]}", place[:-1])

    def turn_on(self, start: int) -> None:
        """Make the comment that starts at a character the element again that it was."""
        off = next((off for tag in self.root.walk() for off in tag.off if off.start == start), None)
        found = OFF.fullmatch(self.text[off.start : off.end]) if off else None
        if off is None or found is None:
            raise SceneError("expected an element that is turned off")
        before = sum(child.end <= off.start for child in self._children(off.above))
        self.write(self.text[: off.start] + found[1] + self.text[off.end :], (*off.above, before))

    def _children(self, place: Place) -> list[Tag]:
        tag = self.find(place)
        return tag.children if tag else []

    def duplicate(self, place: Place) -> None:
        """Put a copy of an element behind it."""
        tag = self._at(place)
        self._insert(place[:-1], place[-1] + 1, self.text[tag.start : tag.end])

    def move(self, place: Place, to: Place) -> None:
        """Move an element before the one at `to`, or to the end of its children if there is none."""
        tag, above = self._at(place), self.find(to[:-1])
        if above is None or to[: len(place)] == place:
            raise SceneError(f"<{tag.name}>: expected a place outside of itself")
        number, text = min(to[-1], len(above.children)), self.text
        marked = self._inserted(above, number, MARK)
        shift = len(marked) - len(text)
        where = marked.index(MARK)
        start, end = (at + shift if where <= at else at for at in self._lines_of(tag))
        made = (marked[:start] + marked[end:]).replace(MARK, text[tag.start : tag.end])
        self.write(made, _moved_place(place, (*to[:-1], number)))

    def _insert(self, above: Place, number: int, snippet: str) -> None:
        tag = self._at(above) if above else self.root
        self.write(self._inserted(tag, number, snippet), (*above, number))

    def _inserted(self, tag: Tag, number: int, snippet: str) -> str:
        """Text with a new child of an element, on a line of its own."""
        text, indent = self.text, self._indent(tag)
        line = f"\n{indent}{INDENT}{snippet}"
        if tag.is_empty:
            start = text[tag.start : tag.inner - 2].rstrip()
            return f"{text[: tag.start]}{start}>{line}\n{indent}</{tag.name}>{text[tag.end :]}"
        if number == 0:
            return text[: tag.inner] + line + text[tag.inner :]
        at = tag.children[number - 1].end
        return text[:at] + line + text[at:]

    def _at(self, place: Place) -> Tag:
        """An element but for `<scene>`, which no edit changes."""
        tag = self.find(place)
        if tag is None or not place:
            raise SceneError("expected an element of the scene")
        return tag

    def _takes_more(self, tag: Tag) -> bool:
        """True if an element may have one more child."""
        most = _most_children(tag.name)
        return most is None or len(tag.children) < most

    def _indent(self, tag: Tag) -> str:
        """White space before the line on which an element starts."""
        line = self.text[self.text.rfind("\n", 0, tag.start) + 1 : tag.start]
        return line[: len(line) - len(line.lstrip())]

    def _lines_of(self, tag: Tag) -> tuple[int, int]:
        """An element with its line, if it is alone there."""
        first = self.text.rfind("\n", 0, tag.start) + 1
        last = self.text.find("\n", tag.end)
        last = len(self.text) if last < 0 else last + 1
        alone = not (self.text[first : tag.start] + self.text[tag.end : last]).strip()
        return (first, last) if alone else (tag.start, tag.end)


def element_of(name: str) -> Element | None:
    """Element of a name under `<scene>`; None for one that is not known."""
    return SECTIONS.get(name) or FORMULAS.get(name)


def _most_children(name: str) -> int | None:
    """Greatest number of children of an element of a name, None for any; of one that is not known, 0."""
    if name == SCENE.name:
        return None
    known = element_of(name)
    return known.children[1] if known else 0


def _moved_place(place: Place, to: Place) -> Place:
    """Where an element is after it was moved before the one at `to`."""
    depth = len(place) - 1
    before = len(to) > depth and to[:depth] == place[:depth] and to[depth] > place[depth]
    return (*to[:depth], to[depth] - 1, *to[depth + 1 :]) if before else to


_ATTRIBUTE = r"(\s+){}\s*=\s*(\"[^\"]*\"|'[^']*')"


def with_attribute(start: str, name: str, value: str | None) -> str:
    """A start tag with an attribute changed, added at its end, or taken away."""
    found = re.search(_ATTRIBUTE.format(re.escape(name)), start)
    if value is None:
        return start[: found.start()] + start[found.end() :] if found else start
    quoted = f'"{escape(value)}"'
    if found:
        return start[: found.start(2)] + quoted + start[found.end(2) :]
    close = "/>" if start.endswith("/>") else ">"
    return f"{start[: -len(close)].rstrip()} {name}={quoted}{close}"


def required(name: str) -> dict[str, str]:
    """Values of what a new element of a name requires."""
    element = element_of(name)
    assert element is not None
    return {a: _starting(kind) for a, kind in element.parameters.items() if kind.default is REQUIRED}


def empty_element(name: str) -> str:
    """A new element without children."""
    given = "".join(f' {attribute}="{value}"' for attribute, value in required(name).items())
    return f"<{name}{given}/>"


def _starting(kind: Parameter) -> str:
    """Text of a value that is valid for a kind; nothing for a file, which a person chooses."""
    if isinstance(kind, File):
        return ""
    if isinstance(kind, Choice):
        return kind.choices[0]
    for value in ("0.1", "1", "2 2 2", "1 1"):
        with suppress(ValueError):
            kind.read(value)
            return value
    return ""
