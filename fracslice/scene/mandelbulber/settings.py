"""Settings files of Mandelbulber 2: text to sections of named values with their lines.

A file is a header of comments with the version, then sections ``[name]`` of lines ``name value;`` that hold
only what differs from the defaults. Numbers have a decimal point or comma; a colour is three hexadecimal
numbers of 16 bits. Names of older versions are read as those of today.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from ...common.files import open_regular
from ...common.messages import hint
from ...common.parameters import printable
from ...errors import SceneError
from .defaults import DEFAULTS

LARGEST_FILE, MOST_LINES, LONGEST_LINE = 4 << 20, 1 << 16, 1 << 16
"""Most bytes and lines of a file, and most characters of a line that is used."""

LARGEST = 1e9
"""Largest number, as in the text of a definition."""

DEEPEST = 99_999
"""Largest whole number."""

MAIN, FRACTALS = "main_parameters", 9
"""Section of the scene, and the most formulas of a file, each with a section ``fractal_1`` and so on."""

KEYFRAMES = "keyframes"
"""Section of a table of what changes from keyframe to keyframe."""

Triple = tuple[float, float, float]

_VERSION = re.compile(r"#\s*version\s+(\d+)[.,](\d+)", re.IGNORECASE)
_SECTION = re.compile(r"\[(\w+)\]\s*")
_NAME = re.compile(r"\w{1,100}")
_INDEXED = re.compile(r"(.*?)_(\d+)$")


@dataclass(frozen=True)
class Setting:
    """Text of a value, and its line."""

    text: str
    line: int


@dataclass
class SettingsSection:
    """Values of a section by name. The names that were asked for are those that are understood."""

    path: str
    name: str
    values: Mapping[str, Setting]
    asked: set[str] = field(default_factory=set)

    def fail(self, name: str, expected: str) -> SceneError:
        """Error about a value: its file and line, the name, the text, and what was expected."""
        value = self.values.get(name)
        place = f"{self.path}:{value.line}" if value else f"{self.path}: [{self.name}]"
        text = printable(value.text) if value else self._default(name)
        shown = text if len(text) <= 40 else text[:37] + "..."
        return SceneError(f"{place}: {name} {shown}: expected {expected}")

    def place(self, name: str) -> str:
        """File and line of a value; the section's where the value is a default."""
        return f"{self.path}:{self.values[name].line}" if name in self.values else self.path

    def given(self, name: str) -> bool:
        """True if the file has a value of this name."""
        return name in self.values

    def text(self, name: str, default: str | None = None) -> str:
        """Text of a value."""
        self.asked.add(name)
        if name in self.values:
            return self.values[name].text
        return self._default(name) if default is None else default

    def flag(self, name: str, default: str | None = None) -> bool:
        """True or false."""
        text = self.text(name, default).lower()
        if text not in ("true", "false", "1", "0"):
            raise self.fail(name, "true or false")
        return text in ("true", "1")

    def numbers(self, name: str, count: int, default: str | None = None) -> tuple[float, ...]:
        """Several numbers."""
        words = self.text(name, default).replace(",", ".").split()
        try:
            numbers = tuple(float(word) for word in words)
        except ValueError:
            numbers = ()
        if len(numbers) != count or not all(abs(number) <= LARGEST for number in numbers):
            what = "a number" if count == 1 else f"{count} numbers"
            raise self.fail(name, f"{what} up to {LARGEST:g}")
        return numbers

    def number(self, name: str, default: str | None = None) -> float:
        """One number."""
        return self.numbers(name, 1, default)[0]

    def vector(self, name: str, default: str | None = None) -> Triple:
        """Three numbers."""
        x, y, z = self.numbers(name, 3, default)
        return x, y, z

    def whole(self, name: str, default: str | None = None) -> int:
        """A whole number from 0 on."""
        number = self.number(name, default)
        if number != int(number) or not 0 <= number <= DEEPEST:
            raise self.fail(name, f"a whole number from 0 to {DEEPEST}")
        return int(number)

    def colour(self, name: str, default: str) -> Triple:
        """Red, green and blue in [0, 1], from numbers of 16 bits in hexadecimal digits."""
        words = self.text(name, default).split()
        if len(words) != 3 or not all(re.fullmatch(r"[0-9a-fA-F]{1,4}", word) for word in words):
            raise self.fail(name, "a colour such as ffff 8000 0000")
        red, green, blue = (round(int(word, 16) / 65535, 4) for word in words)
        return red, green, blue

    def one_of(self, name: str, words: tuple[str, ...]) -> str:
        """A word of a list, or its number in the list."""
        text = self.text(name, words[0])
        if text.isdigit() and int(text) < len(words):
            return words[int(text)]
        if text not in words:
            raise self.fail(name, hint(text, words, "{}"))
        return text

    def unasked(self) -> Iterator[tuple[str, Setting]]:
        """Names and values that nothing asked for."""
        return ((name, value) for name, value in self.values.items() if name not in self.asked)

    def _default(self, name: str) -> str:
        return default_of(name)


def default_of(name: str) -> str:
    """Text of the default of a parameter of a formula; of a numbered one, that of all."""
    if name not in DEFAULTS and (match := _INDEXED.fullmatch(name)):
        name = match[1]
    return DEFAULTS[name]


@dataclass(frozen=True)
class Settings:
    """A settings file."""

    path: str
    version: float
    main: SettingsSection  # the scene
    fractals: tuple[SettingsSection, ...]  # parameters of each formula
    others: tuple[str, ...] = ()  # names of the other sections, such as frames
    keyframes: tuple[tuple[int, str], ...] = ()  # lines of their table with their numbers

    @property
    def sections(self) -> tuple[SettingsSection, ...]:
        """All sections with values."""
        return (self.main, *self.fractals)


def read_settings(path: str | os.PathLike[str]) -> Settings:
    """Read a settings file.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Settings
        Its sections.

    Raises
    ------
    SceneError
        If the file cannot be read, or a line is not of the format: "file:line: message".
    """
    source = os.fspath(path)
    try:
        with open_regular(source) as file:
            data = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise SceneError(f"{source}: {error.strerror or error}") from None
    if len(data) > LARGEST_FILE:
        raise SceneError(f"{source}: expected settings of at most {LARGEST_FILE >> 20} MB")
    if b"\0" in data or not data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith((b"#", b"[")):
        raise SceneError(f"{source}: not settings of Mandelbulber: expected text that begins with # or [")
    return parse_settings(data.decode("utf-8-sig", "replace"), source)


def parse_settings(text: str, source: str) -> Settings:
    """Parse the text of a settings file; see `read_settings`."""
    lines = text.splitlines()
    if len(lines) > MOST_LINES:
        raise SceneError(f"{source}: expected settings of at most {MOST_LINES} lines")
    version, found, current = _version(lines), dict[str, dict[str, Setting]](), ""
    keyframes: list[tuple[int, str]] = []
    for number, line in enumerate(lines, 1):
        if match := _SECTION.fullmatch(line.strip()):
            current = match[1]
            found.setdefault(current, {})
        elif (current == MAIN or _fractal(current)) and line.strip() and not line.startswith("#"):
            name, value = _line(line, f"{source}:{number}")
            for new, changed in _renamed(name, value, version):
                found[current][new] = Setting(changed, number)
        elif current == KEYFRAMES:
            keyframes.append((number, line))
    if MAIN not in found:
        raise SceneError(f"{source}: expected a section [{MAIN}]")
    main = SettingsSection(source, MAIN, found[MAIN])
    numbered = tuple(f"fractal_{k}" for k in range(1, FRACTALS + 1))
    fractals = tuple(SettingsSection(source, name, found.get(name, {})) for name in numbered)
    others = tuple(name for name in found if name not in (MAIN, KEYFRAMES, "description", *numbered))
    return Settings(source, version, main, fractals, others, tuple(keyframes))


def _fractal(name: str) -> bool:
    return name.startswith("fractal_")


def _version(lines: list[str]) -> float:
    """Version of the program that wrote the file: 2.071 has two numbers. That of today without one."""
    for line in lines[:10]:
        if match := _VERSION.match(line):
            return float(f"{match[1]}.{match[2]}")
    return math.inf


def _line(line: str, place: str) -> tuple[str, str]:
    """Name and value of a line; what is behind the first semicolon is a script of an animation."""
    if len(line) > LONGEST_LINE:
        raise SceneError(f"{place}: expected a line of at most {LONGEST_LINE} characters")
    name, space, rest = line.strip().partition(" ")
    value, semicolon, _ = rest.partition(";")
    if not space or not semicolon or not _NAME.fullmatch(name):
        shown = printable(line.strip())
        shown = shown if len(shown) <= 40 else shown[:37] + "..."
        raise SceneError(f"{place}: {shown}: expected a name, a value and a semicolon")
    return name, value.strip().strip("\"'")


_MOVED = {  # of version 2.07 and before: properties of the first material
    name: f"mat1_{new}"
    for name, new in (
        ("shading", "shading"),
        ("specular", "specular"),
        ("reflect", "reflectance"),
        ("transparency_of_surface", "transparency_of_surface"),
        ("transparency_index_of_refraction", "transparency_index_of_refraction"),
        ("coloring_speed", "coloring_speed"),
        ("coloring_palette_offset", "coloring_palette_offset"),
        ("fractal_color", "use_colors_from_palette"),
        ("surface_color_palette", "surface_color_palette"),
        ("fractal_coloring_algorithm", "fractal_coloring_algorithm"),
    )
}

_LIGHTS = {  # of version 2.24 and before: the main light is the first, the others are numbered from 2
    "main_light_intensity": "light1_intensity",
    "main_light_visibility_size": "light1_size",
    "main_light_alpha": "light1_alpha",
    "main_light_beta": "light1_beta",
    "main_light_colour": "light1_color",
    "main_light_enable": "light1_enabled",
    "main_light_position_relative": "light1_relative_position",
    "shadows_enabled": "light1_cast_shadows",
    "shadows_cone_angle": "light1_soft_shadow_cone",
}

_AUXILIARY = re.compile(r"aux_light_(intensity|position|enabled|colour)_(\d)")


def _renamed(name: str, value: str, version: float) -> Iterator[tuple[str, str]]:
    """Names and values of today for those of a version."""
    if version <= 2.01:
        name = name.replace("aux_light_predefined", "aux_light")
    if version <= 2.04 and name == "fractal_constant_factor" and len(value.split()) == 1:
        value = " ".join([value] * 3)
    if version <= 2.071:
        name = _MOVED.get(name, name)
    if version < 2.19 and name.endswith("surface_color_palette"):
        name, value = name.replace("palette", "gradient"), _gradient(value)
    if version < 2.25:
        name = _LIGHTS.get(name, name)
        if match := _AUXILIARY.fullmatch(name):
            what = "color" if match[1] == "colour" else match[1]
            name = f"light{int(match[2]) + 1}_{what}"
            yield f"light{int(match[2]) + 1}_is_defined", "true"
    yield name, value


def _gradient(palette: str) -> str:
    """Gradient with the colours of a palette at equal distances, of 10000 in all."""
    colours = [word for word in palette.split() if len(word) == 6]
    step = 1 / max(len(colours), 1)
    return " ".join(f"{int(k * step * 10000)} {colour}" for k, colour in enumerate(colours))
