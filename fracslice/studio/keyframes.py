"""The film of a document: keyframes of its camera and of any attribute, which are the tracks of its text."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import SceneError
from ..scene.model import part_to_xml
from ..scene.view import Animation, Camera, Keyframes, Keys, Seconds, Track
from .document import Document, Tag
from .views import rounded

KEYS, SECONDS = Keys("", ""), Seconds(0.0, "")

LENGTH = 4.0
"""Length of a new film, seconds."""

RECORDED = 2.0
"""Views of a recorded flight in a second."""

SAME = 1e-3
"""Difference of two times that are one, seconds."""


def path_of(document: Document, tag: Tag, attribute: str) -> str:
    """Name of an attribute as tracks and settings use it, such as box[2].round."""
    same = [other for other in document.root.walk() if other.name == tag.name]
    number = next(k for k, other in enumerate(same, 1) if other.place == tag.place)
    return f"{tag.name}{f'[{number}]' if len(same) > 1 else ''}.{attribute}"


def track_of(document: Document, of: str) -> Tag | None:
    """Track of an attribute."""
    return next((tag for tag in _parts(document, Track.element) if tag.attributes.get("of") == of), None)


def keys_of(track: Tag | None, attribute: str = "keys") -> Keyframes:
    """Keyframes of a track, or its slopes; none of what is not valid."""
    try:
        return KEYS.read(track.attributes[attribute]) if track else ()
    except (KeyError, ValueError):
        return ()


def rows(document: Document) -> list[dict[str, Any]]:
    """Tracks as a page shows them: attribute, curve, and times in seconds."""
    return [
        {
            "of": tag.attributes.get("of", ""),
            "curve": tag.attributes.get("curve", "auto"),
            "times": [time for time, _ in keys_of(tag)],
        }
        for tag in _parts(document, Track.element)
    ]


def duration(document: Document) -> float:
    """Length of the film, seconds; 0 of a scene without one."""
    animation = document.scene.animation
    return animation.duration if animation else 0.0


def begin(document: Document, seconds: float = LENGTH) -> None:
    """Give a scene without a film an `<animation>`, or set its length."""
    tag = document.part(Animation.element)
    with document.one_edit():
        if tag is None:
            document.write_part(Animation(duration=seconds))
        else:
            document.set_value(tag.place, "duration", SECONDS.text(seconds))


def set_keys(document: Document, seconds: float, values: Mapping[str, str]) -> None:
    """Set keyframes of some attributes at a time, all by one edit; a film is begun where there is none."""
    seconds = round(seconds, 3)
    with document.one_edit():
        if document.part(Animation.element) is None:
            begin(document)
        for of, text in values.items():
            track = track_of(document, of)
            others = [key for key in keys_of(track) if not _same(key[0], seconds)]
            _write_keys(document, of, track, sorted([*others, (seconds, text)]))


def remove_key(document: Document, of: str, seconds: float) -> None:
    """Remove a keyframe; with the last one, its track."""
    track = _existing(document, of)
    left, slopes = (
        [k for k in keys_of(track, name) if not _same(k[0], seconds)] for name in ("keys", "slopes")
    )
    with document.one_edit():
        if left:
            _write_slopes(document, track, slopes)
            _write_keys(document, of, _existing(document, of), left)
        else:
            document.remove(track.place)


def move_key(document: Document, of: str, seconds: float, to: float) -> None:
    """Move a keyframe to another time."""
    track, to = _existing(document, of), round(max(to, 0.0), 3)
    moved, slopes = (
        sorted((to if _same(time, seconds) else time, text) for time, text in keys_of(track, name))
        for name in ("keys", "slopes")
    )
    if len({time for time, _ in moved}) < len(moved):
        raise SceneError(f"{of}: has a keyframe at {to:g}s already")
    with document.one_edit():
        _write_slopes(document, track, slopes)
        _write_keys(document, of, _existing(document, of), moved)


def set_slope(document: Document, of: str, seconds: float, slope: Sequence[float] | None) -> None:
    """Give the curve a slope at a keyframe, per second, of each number; None has it chosen again."""
    track = _existing(document, of)
    others = [key for key in keys_of(track, "slopes") if not _same(key[0], seconds)]
    own = [] if slope is None else [(seconds, _words(slope))]
    with document.one_edit():
        _write_slopes(document, track, sorted([*others, *own]))


def set_number(document: Document, of: str, seconds: float, part: int, value: float) -> None:
    """Change one of the numbers of a keyframe."""
    track = _existing(document, of)
    keys = [(time, text.split()) for time, text in keys_of(track)]
    for when, words in keys:
        if _same(when, seconds):
            words[part] = f"{value:.6g}"
    with document.one_edit():
        _write_keys(document, of, track, [(time, " ".join(words)) for time, words in keys])


def _same(time: float, other: float) -> bool:
    return abs(time - other) <= SAME


def _words(numbers: Sequence[float]) -> str:
    return " ".join(f"{number:.6g}" for number in numbers)


def _write_slopes(document: Document, track: Tag, slopes: Sequence[tuple[float, str]]) -> None:
    text = KEYS.text(KEYS.check(slopes)) if slopes else None
    if text != track.attributes.get("slopes"):
        document.set_value(track.place, "slopes", text)


def set_curve(document: Document, of: str, curve: str) -> None:
    """Choose the curve between the keyframes of an attribute; only a smooth one has slopes."""
    track = _existing(document, of)
    with document.one_edit():
        if curve not in ("auto", "smooth"):
            _write_slopes(document, track, ())
        document.set_value(track.place, "curve", None if curve == "auto" else curve)


def _existing(document: Document, of: str) -> Tag:
    track = track_of(document, of)
    if track is None:
        raise SceneError(f"{of}: has no keyframes")
    return track


def key_view(document: Document, seconds: float, camera: Camera) -> None:
    """Set keyframes of a view."""
    scene, camera = document.scene.view.camera, rounded(camera)
    names = ["eye", "target"]
    names += [n for n in ("up", "fov") if scene and getattr(camera, n) != getattr(scene, n)]
    kinds = Camera.kinds()
    with document.one_edit():
        if scene is None:
            document.write_part(camera)
        set_keys(document, seconds, {f"camera.{n}": kinds[n].text(getattr(camera, n)) for n in names})


def write_flight(document: Document, views: Sequence[tuple[float, Camera]]) -> None:
    """Write a recorded flight as the film of the camera.

    `views`: times in seconds from 0 on, and what was seen.
    """
    kinds, views = Camera.kinds(), [(time, rounded(camera)) for time, camera in views]
    with document.one_edit():
        if document.scene.view.camera is None:
            document.write_part(views[0][1])
        begin(document, round(views[-1][0], 3))
        for name in "eye", "target":
            of = f"camera.{name}"
            keys = [(round(time, 3), kinds[name].text(getattr(camera, name))) for time, camera in views]
            _write_keys(document, of, track_of(document, of), keys)


def _write_keys(document: Document, of: str, track: Tag | None, keys: Sequence[tuple[float, str]]) -> None:
    if track is None:
        document.append(part_to_xml(Track(of=of, keys=KEYS.check(keys))))
    else:
        document.set_value(track.place, "keys", KEYS.text(KEYS.check(keys)))


def _parts(document: Document, name: str) -> list[Tag]:
    return [tag for tag in document.root.children if tag.name == name]


class Player:
    """Time of a film that is looked at: where it stands, whether it plays, and a flight that is recorded."""

    def __init__(self) -> None:
        self.seconds: float | None = None  # None: the scene as it is without its film
        self._began: float | None = None  # clock at the beginning of the film, while it plays
        self._record: list[tuple[float, Camera]] | None = None
        self._recorded_from = 0.0

    @property
    def is_playing(self) -> bool:
        """True while time goes on."""
        return self._began is not None

    @property
    def is_recording(self) -> bool:
        """True while a flight is recorded."""
        return self._record is not None

    def seek(self, seconds: float | None) -> None:
        """Stop at a time; None leaves the film."""
        self.seconds, self._began = seconds, None

    def play(self, length: float) -> None:
        """Go on from where it stands, from the beginning at the end."""
        begin = self.seconds if self.seconds is not None and self.seconds < length - SAME else 0.0
        self._began = time.monotonic() - begin

    def advance(self, length: float, camera: Camera) -> bool:
        """Go on with time and with the record of a flight; True if time went on."""
        now = time.monotonic()
        if self._record is not None and (
            not self._record or now - self._recorded_from >= len(self._record) / RECORDED
        ):
            self._recorded_from = self._recorded_from if self._record else now
            self._record.append((now - self._recorded_from, camera))
        if self._began is None:
            return False
        self.seconds = min(now - self._began, length)
        if self.seconds >= length:
            self._began = None
        return True

    def record(self) -> None:
        """Begin to record a flight."""
        self._record = []

    def recorded(self) -> list[tuple[float, Camera]]:
        """End the record: times in seconds from 0 on, and views."""
        made, self._record = self._record or [], None
        return made
