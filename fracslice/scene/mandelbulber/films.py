"""Keyframes of Mandelbulber as the tracks of a film: the camera, and numbers of formulas."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ...errors import SceneError
from ...formulas import Node
from ..view import Animation, Track
from .settings import LARGEST, Settings

CAMERA = {"camera": "camera.eye", "target": "camera.target", "camera_top": "camera.up", "fov": "camera.fov"}
"""Attributes of the camera by their names in a file."""

EACH, INTERPOLATION = "framesPerKeyframe", "interpolation"
"""Column with the frames after each keyframe, and the row with the kinds of curves."""

MOST_KEYS, MOST_COLUMNS = 2000, 500
"""Most keyframes, and most columns of their table."""

_FRACTAL = re.compile(r"fractal(\d)_(\w+)")


@dataclass(frozen=True)
class Column:
    """What a track of a file moves: columns of the table, one or three."""

    name: str
    places: tuple[int, ...]


def film(settings: Settings, root: Node, notes: list[str]) -> tuple[Animation | None, tuple[Track, ...]]:
    """Film of a file; what its keyframes move and a scene does not is noted."""
    rows = [(line, text.split(";")) for line, text in settings.keyframes if text.strip()]
    rows = [row for row in rows if row[1][0] != INTERPOLATION]
    if len(rows) < 3:
        return None, ()
    if len(rows) > MOST_KEYS or len(rows[0][1]) > MOST_COLUMNS:
        raise SceneError(f"{settings.path}:{rows[0][0]}: expected at most {MOST_KEYS} keyframes")
    table = [_numbers(settings.path, line, words, len(rows[0][1])) for line, words in rows[1:]]
    times = _times(settings, rows[0][1], table)
    tracks = []
    for column in _columns(rows[0][1]):
        values = [tuple(row[k] for k in column.places) for row in table]
        if len(set(values)) < 2:
            continue
        of = _target(column.name, root)
        if of is None:
            notes.append(f"{settings.path}:{rows[0][0]}: {column.name}: its keyframes are left out")
            continue
        keys = tuple((time, " ".join(map(repr, v))) for time, v in zip(times, values, strict=True))
        tracks.append(Track(of=of, keys=keys))
    return (Animation(duration=times[-1], fps=30.0), tuple(tracks)) if tracks else (None, ())


def _times(settings: Settings, heading: Sequence[str], table: Sequence[Sequence[float]]) -> list[float]:
    """Seconds of each keyframe: after each are as many frames as its row, or the file, says."""
    frames = float(settings.main.whole("frames_per_keyframe", "100"))
    place = heading.index(EACH) if EACH in heading else 0
    rate = max(settings.main.number("keyframe_frames_per_second", "30"), 0.01)
    steps = [max(row[place], 1.0) if place else max(frames, 1.0) for row in table[:-1]]
    return [round(sum(steps[:k]) / rate, 6) for k in range(len(table))]


def _numbers(path: str, line: int, words: Sequence[str], count: int) -> list[float]:
    """Numbers of a row of the table; texts are 0."""
    if len(words) != count:
        raise SceneError(
            f"{path}:{line}: keyframe of {len(words)} values: expected {count}, as in its heading"
        )
    return [_number(word) for word in words]


def _number(word: str) -> float:
    try:
        value = float(word.replace(",", "."))
    except ValueError:
        return 0.0
    return value if abs(value) <= LARGEST else 0.0


def _columns(heading: Sequence[str]) -> Iterator[Column]:
    """Columns of a table; three that end in x, y and z are a vector."""
    k = 1
    while k < len(heading):
        name = heading[k].strip()
        if name == EACH:
            k += 1
            continue
        after = [word.strip() for word in heading[k : k + 3]]
        if name.endswith("_x") and after == [name[:-1] + axis for axis in "xyz"]:
            yield Column(name[:-2], (k, k + 1, k + 2))
            k += 3
        else:
            yield Column(name, (k,))
            k += 1


def _target(name: str, root: Node) -> str | None:
    """Attribute of our scene for a name of a table; None if there is none, or there are several."""
    if name.startswith("main_"):
        return CAMERA.get(name.removeprefix("main_"))
    match = _FRACTAL.fullmatch(name)
    if match is None:
        return None
    wanted = {match[2].lower(), f"{match[2].lower()}_of"}
    found = {
        f"{node.formula.name}.{key}" for node in root.walk() for key in wanted & {*node.formula.parameters}
    }
    return found.pop() if len(found) == 1 else None
