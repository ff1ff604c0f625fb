"""What a studio does, without a page: the document, the live picture of it, and jobs in the background."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..animation import ENDINGS as FILM_ENDINGS
from ..animation import FilmJob, Timeline, check_film, encode, has_frames, write_frames
from ..common.files import replacing
from ..common.parameters import AUTO, Number
from ..errors import Cancelled, FracsliceError, SceneError
from ..export.images import IMAGES
from ..export.layers import ENDINGS as LAYER_ENDINGS
from ..export.notebooks import NOTEBOOK, write_notebook
from ..fields.box import Box
from ..fields.registry import Fixed
from ..formats import ENDINGS, SOLIDS
from ..formulas import Node, intersection, plane
from ..mesh.drawing import Plane
from ..rendering import Renderer
from ..rendering.live import Live, Shown
from ..scene import library
from ..scene.layout import SOLID, varied
from ..scene.model import Scene, to_xml
from ..scene.view import Camera, View
from ..work import Work
from . import keyframes
from .bookmarks import Bookmarks, between, is_worth_a_look
from .document import Document, Place, Tag, with_attribute
from .handles import LightHandle
from .inside import Inside
from .keyframes import Player
from .panels import controls
from .views import Pixel, Views, depth_of, rounded
from .views import between as view_between

THUMBNAIL, SAMPLES = (200, 150), 4
"""Pixels of the picture of a variation, and samples of each."""

PRINT_ENDINGS = tuple(ending for ending in LAYER_ENDINGS if ending and ending not in ENDINGS)
"""Endings of files of layers that are no meshes."""

FILMS = tuple(ending for ending in FILM_ENDINGS if ending not in IMAGES)
"""Endings of films."""

LENS = 0.01
"""Radius of the lens that a camera is given when it is first focused, of the distance that is in focus."""

SURPRISE, SURPRISES = 0.5, 20
"""Size of the changes of a surprise, and how often one is drawn."""

NUDGE = 2.0**-30
"""By what a number is off, relative to it, that would otherwise be a constant of the code."""


def loosened(node: Node) -> Node:
    """The same solid, but for less than a pixel, by code that serves any value of its numbers.

    A whole power is a constant of its code: any other would be compiled.
    """
    children = tuple(map(loosened, node.children))
    for name, kind in node.formula.parameters.items():
        value = node[name]
        if type(kind) is not Number or not isinstance(value, float) or not value or value % 1:
            continue
        with suppress(SceneError):
            nudged: dict[str, Any] = {name: value * (1 + NUDGE)}
            other = node.changed(**nudged)
            if _constants(other) != _constants(node):
                node = other
    return node.changed(children)


def _constants(node: Node) -> object:
    """What of an element's own numbers is in its code."""
    depths: dict[str, Any] = {name: 1 for name, value in node.values.items() if value == AUTO}
    known = node.changed(**depths) if depths else node
    return known.function, [value for value in known.arguments.values() if isinstance(value, Fixed)]


class Latest:
    """The last valid scene of a document, as a `rendering.live.SceneSource`."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._seen = scene, scene

    def put(self, scene: Scene) -> None:
        """Show another scene from now on."""
        self._scene = scene

    def read(self) -> Scene:
        """See `SceneSource.read`."""
        self._seen = self._scene
        return self._seen

    def changed(self) -> bool:
        """See `SceneSource.changed`."""
        return self._scene is not self._seen


@dataclass(frozen=True)
class CutPlane:
    """A plane across an axis that cuts the picture open."""

    axis: int
    share: float  # of the length along it
    flipped: bool  # whether the part with larger coordinates stays

    def half(self, box: Box) -> Node:
        """The half of space that stays."""
        before = self.plane(box)
        return plane(before.normal, before.offset)

    def plane(self, box: Box) -> Plane:
        """The plane before which all is cut away; an unbounded solid counts as 20 units long."""
        low, high = max(box.lo[self.axis], -10.0), min(box.hi[self.axis], 10.0)
        at = low + self.share * (high - low)
        normal = [0.0, 0.0, 0.0]
        normal[self.axis] = -1.0 if self.flipped else 1.0
        return Plane((normal[0], normal[1], normal[2]), -at if self.flipped else at)


@dataclass(eq=False)
class Job:
    """What is made in the background."""

    name: str
    command: str = ""  # that makes the same
    stage: str = "beginning"
    share: float = 0.0
    result: str = ""  # what was made, once it is
    problem: str = ""  # why it was not
    cancel: threading.Event = field(default_factory=threading.Event)

    @property
    def is_done(self) -> bool:
        """True once it ended, however."""
        return bool(self.result or self.problem)

    def progress(self, stage: str, share: float) -> None:
        """See `Work.progress`."""
        self.stage, self.share = stage, share


class Session:
    """A scene that is looked at, changed and made. Call `close` at the end.

    Parameters
    ----------
    source : str or Document
        Scene file, model file, or name of a shipped scene; or a document.
    folder : Path
        Folder below which files are written.
    work : Work, optional
        Threads.
    device : {"cpu", "cuda", "auto"}
        Device that traces the rays.
    files_outside : bool
        Whether models may lie outside of the scene's folder.

    Raises
    ------
    SceneError
        If the source is no scene.
    """

    def __init__(
        self,
        source: str | Document,
        folder: Path,
        work: Work | None = None,
        device: str = "auto",
        files_outside: bool = False,
    ) -> None:
        self.folder, self._work, self._files_outside = folder, work or Work(), files_outside
        self._seed, self._drawn, self._device = secrets.randbits(32), 0, device
        if isinstance(source, Document):
            self.document, self.target = source, folder / source.path.name
        else:
            self.document, self.target = opened(source, folder, files_outside)
        self.listeners: list[Callable[[Scene], object]] = []
        self._told = self.document.scene
        self.bookmarks = Bookmarks(self.target)
        self._scene = Latest(self.document.scene)
        self.live = Live(self._scene, work=self._work, device=device)
        self.views = Views(self.live)
        self._compile_ahead()
        self.message = ""
        self.job: Job | None = None
        self.section: CutPlane | None = None
        self.player = Player()
        self._film: Timeline | None = None
        self._worker: threading.Thread | None = None
        self.inside = Inside(self, self._work)

    def _compile_ahead(self) -> None:
        """Compile in the background what the first edit of a number will need."""
        scene, root = self.document.scene, loosened(self.document.scene.root)
        if root != scene.root:
            work = replace(self._work, threads=1, cancel=threading.Event())
            make = partial(Renderer, root, scene.view, (16, 16), work, self._device)
            # no daemon: a process must not end while it compiles
            threading.Thread(target=make, name="fracslice compiling").start()

    def close(self) -> None:
        """Stop rendering and the job."""
        if self.job and self._worker:
            self.job.cancel.set()
            self._worker.join()
        self.live.close()

    @property
    def scene(self) -> Scene:
        """The last valid scene."""
        return self.document.scene

    @property
    def cut_plane(self) -> Plane | None:
        """The plane that cuts the picture open, if one does."""
        return self.section.plane(self.scene.root.bounds.box) if self.section else None

    @property
    def shown(self) -> Shown:
        """The picture and what is known of it."""
        return self.live.shown

    def open(self, source: str) -> None:
        """Open another scene, seen by its own camera."""
        self._open(*opened(source, self.folder, self._files_outside))

    def _open(self, document: Document, target: Path) -> None:
        self.document, self.target = document, target
        self.bookmarks, self.section = Bookmarks(target), None
        self.views.forget()
        self.inside.release()
        self.player = Player()
        self._scene.put(self.document.scene)
        self.live.wake()
        self._compile_ahead()

    @property
    def scenes(self) -> list[dict[str, str]]:
        """What can be opened, with its description: shipped scenes, and files of the folder."""
        shipped = [*library.names(), *library.gallery()]
        own = (path.name for path in self.folder.glob("*") if path.suffix.lower() in (".xml", *SOLIDS))
        known = [{"name": name, "doc": library.about(name)} for name in shipped]
        return known + [{"name": name, "doc": ""} for name in sorted(own)]

    def variations(self, spread: float, count: int = 9) -> Iterator[tuple[Node, NDArray[np.uint8]]]:
        """Trees with other numbers, drawn at random, and their pictures as the page sees the scene."""
        scene, view = self.document.scene, replace(self.document.scene.view, camera=self.live.camera)
        for _ in range(count):
            self._drawn += 1
            other = varied(scene, (self._seed, self._drawn), spread)
            renderer = Renderer(loosened(other.root), view, THUMBNAIL, self._work, self._device)
            *_, done = renderer.passes(SAMPLES)
            yield other.root, done.shown

    def bookmark(self) -> None:
        """Keep the scene as it is and is seen, with a small picture of it."""
        if self.document.problem:
            self.message = "a bookmark is of a valid scene"
            return
        copy = Document(self.document.text, self.document.path, self._files_outside)
        copy.write_part(rounded(self.live.camera))
        self.bookmarks.add(copy.text, jpeg(thumbnail(self.shown.pixels), 80))

    def go_to(self, name: str) -> None:
        """Return to a bookmark, with its view."""
        self.edit(lambda: self.document.write(self.bookmarks.text(name)))

    def mix(self, first: Scene, name: str, share: float) -> None:
        """Show what lies between a scene and a bookmark, which have the same elements."""
        self.edit(self._mix, first, name, share)

    def _mix(self, first: Scene, name: str, share: float) -> None:
        last = self.bookmarks.document(name, self._files_outside).scene
        self._write_values(between(first.root, last.root, share), "mix")
        cameras = first.view.camera, last.view.camera
        if cameras[0] and cameras[1]:
            self.views.look(view_between(cameras[0], cameras[1], share))

    def surprise(self) -> None:
        """Open a shipped scene with other numbers: a solid that is not empty and no ball."""
        names = [*library.names(), *library.gallery()]
        for _ in range(SURPRISES):
            self._drawn += 1
            name = names[(self._seed + 7 * self._drawn) % len(names)]
            document, target = opened(name, self.folder, self._files_outside)
            with suppress(SceneError):
                other = varied(document.scene, (self._seed, self._drawn), SURPRISE)
                if is_worth_a_look(other.root):
                    self._open(document, target)
                    self.take(other.root)
                    return
        self.message = "no surprise was found; try again"

    def take(self, root: Node) -> None:
        """Write the numbers of a variation into the text."""
        self.edit(self._write_values, root)

    def _write_values(self, root: Node, what: str = "") -> None:
        """Write the numbers of a tree that has the elements of the document; `what`: see `Document.write`."""
        document = self.document
        pairs = zip(root.walk(), document.scene.root.walk(), strict=True)
        # what has no place is the union of elements side by side
        nodes = [(node, old) for node, old in pairs if old.place]
        tags = [tag for tag in document.root.walk() if len(tag.place) > 1 and self._is_of_solid(tag)]
        text = document.text
        for tag, (node, before) in reversed(list(zip(tags, nodes, strict=True))):
            start = text[tag.start : tag.inner]
            for name, kind in node.formula.parameters.items():
                if node[name] != before[name]:
                    start = with_attribute(start, name, kind.text(node[name]))
            text = text[: tag.start] + start + text[tag.inner :]
        document.write(text, what=what)

    def _is_of_solid(self, tag: Tag) -> bool:
        return self.document.root.children[tag.place[0]].name == SOLID.name

    def edit(self, change: Callable[..., None], *arguments: Any) -> None:
        """Change the document, and show what it is now; what cannot be done is said in `message`."""
        self.message = ""
        try:
            change(*arguments)
        except SceneError as error:
            self.message = str(error)
        self._tell()
        self._show()

    def _tell(self) -> None:
        """Tell those who listen of another scene."""
        if self.document.scene is not self._told:
            self._told = self.document.scene
            for act in self.listeners:
                act(self._told)

    def _show(self) -> None:
        """Show the scene as it is now, at the time of its film, cut open if it is to be."""
        scene = self._at_time()
        root = loosened(scene.root)
        if self.section:
            root = intersection(root, self.section.half(root.bounds.box))
        scene = replace(scene, root=root)
        if scene.view.camera and self._is_flown and _unseen(scene) == _unseen(self.live.scene):
            self.views.look(scene.view.camera)
            return
        self._scene.put(scene)
        self.live.wake()

    @property
    def _is_flown(self) -> bool:
        """True if the film that is looked at moves the camera."""
        return self.film is not None and any(t.of.startswith("camera.") for t in self.film.scene.tracks)

    def _at_time(self) -> Scene:
        """The scene at the time of its film; as it is without it where it has none."""
        if self.film is None or self.player.seconds is None:
            return self.document.scene
        try:
            return self.film.at(self.player.seconds)
        except SceneError as error:
            self.message = str(error)
            return self.document.scene

    @property
    def film(self) -> Timeline | None:
        """The film that is looked at."""
        scene = self.document.scene
        if self.player.seconds is None or scene.animation is None:
            return None
        if self._film is None or self._film.scene is not scene:
            self._film = Timeline(scene)
        return self._film

    def advance(self) -> None:
        """Go on with flights and with the film; to be called again and again."""
        self.views.advance()
        if self.player.advance(keyframes.duration(self.document), self.live.aim):
            self._show()

    def seek(self, seconds: float | None) -> None:
        """Look at a time of the film; None leaves it."""
        self.player.seek(seconds)
        self._show()

    def record(self) -> None:
        """Begin to record a flight, or end it and make it the film."""
        if not self.player.is_recording:
            self.player.record()
            return
        views = self.player.recorded()
        if len(views) < 2:
            self.message = "a flight of a second or more is expected"
        else:
            self.edit(keyframes.write_flight, self.document, views)

    def at_time(self, tag: Tag) -> Tag:
        """An element with the values that it has at the time of the film."""
        if self.film is None or self.player.seconds is None or self.document.problem:
            return tag
        prefix = keyframes.path_of(self.document, tag, "")
        moving = [track.of for track in self.film.scene.tracks if track.of.startswith(prefix)]
        values = {of.removeprefix(prefix): self.film.value(of, self.player.seconds) for of in moving}
        return replace(tag, attributes={**tag.attributes, **values})

    def set_value(self, place: Place, attribute: str, value: str | None) -> None:
        """Change an attribute; one that moves gets a keyframe at the time of the film."""
        document, tag, seconds = self.document, self.document.find(place), self.player.seconds
        if tag and value is not None and seconds is not None:
            of = keyframes.path_of(document, tag, attribute)
            if keyframes.track_of(document, of):
                self.edit(keyframes.set_keys, document, seconds, {of: value})
                return
        self.edit(document.set_value, place, attribute, value)

    def cut(self, axis: str, share: float) -> None:
        """Cut the picture open across an axis, at a share of the length along it; the file stays whole."""
        if not axis:
            self.section = None
        else:
            number, camera = "xyz".index(axis), self.live.aim
            towards = camera.eye[number] < camera.target[number]
            same = self.section and self.section.axis == number
            self.section = CutPlane(number, share, self.section.flipped if self.section and same else towards)
        self._show()
        self.inside.draw()

    def set_number(self, place: Place, attribute: str, index: int, value: float) -> None:
        """Change one of the numbers of an attribute."""
        tag = self.document.find(place)
        shown = controls(self.at_time(tag)) if tag else []
        control = next((c for c in shown if c["name"] == attribute), None)
        if control is None or "values" not in control:
            return
        numbers = list(control["values"])
        numbers[index] = value
        self.set_value(place, attribute, " ".join(f"{n:.6g}" for n in numbers))

    def set_part(self, part: str, attribute: str, value: str | None) -> None:
        """Give an attribute of an element below `<scene>` a value, or take it away; it is added at need."""
        tag = self.document.part(part)
        if tag is not None:
            self.edit(self.document.set_value, tag.place, attribute, value)
        elif value is not None:
            self.edit(self.document.append, f'<{part} {attribute}="{escape(value)}"/>')

    def keep_view(self) -> None:
        """Write the camera into the scene."""
        self.edit(self.document.write_part, rounded(self.live.camera))

    def focus_on(self, at: Pixel) -> None:
        """Write the camera into the scene, focused on what is under the mouse."""
        point, camera = self.views.surface_at(at), self.live.camera
        if point is None or camera.kind != "perspective":
            self.message = "no surface of a perspective view is there"
            return
        depth = depth_of(camera, point)
        lens = camera.aperture or float(f"{LENS * depth:.2g}")
        focused = replace(rounded(camera), aperture=lens, focus=float(f"{depth:.6g}"))
        self.edit(self.document.write_part, focused)

    @property
    def handle(self) -> LightHandle | None:
        """Handle of the light that is chosen."""
        return LightHandle.of(self.document)

    def drag_handle(self, at: Pixel) -> None:
        """Move the light that is chosen to a pixel of the picture."""
        if handle := self.handle:
            moved = handle.dragged(at, self.live.camera, self.live.size)
            text = " ".join(f"{number:g}" for number in moved.light.position)
            self.edit(self.document.set_value, moved.place, "position", text)

    def save(self) -> None:
        """Write the text into its file."""
        with replacing(self.target) as file:
            file.write(self.document.text.encode())
        self.document.saved = self.document.text
        self.message = f"saved {self.target.name}"

    def _inside(self, name: str) -> Path:
        path = (self.folder / name).resolve()
        if not path.is_relative_to(self.folder.resolve()):
            raise SceneError(f"{name}: expected a file in {self.folder}")
        return path

    def start(self, name: str, options: dict[str, Any]) -> None:
        """Begin to make a file by its extension, one at a time: a picture, film, mesh, layers or notebook."""
        path = self._inside(name)
        known = *IMAGES, *ENDINGS, *FILMS, *PRINT_ENDINGS, NOTEBOOK
        if path.suffix.lower() not in known:
            raise SceneError(f"{name}: expected a file of {', '.join(known)}")
        if path.suffix.lower() in PRINT_ENDINGS:
            self.inside.check_file(path)
        make = partial(self._file, path, self.document.scene, self.live.camera, options)
        self.run(path.name, make, command(self.target, name, options))

    def run(self, name: str, make: Callable[[Work], str], command: str = "") -> None:
        """Begin a job in the background, if none is running: it says what it made, in a line."""
        if self.job and not self.job.is_done:
            self.message = f"{self.job.name} is being made; cancel it first"
            return
        self.message, job = "", Job(name, command)
        self.job = job
        self._worker = threading.Thread(target=self._run, args=(job, make), name="fracslice job")
        self._worker.start()

    def _run(self, job: Job, make: Callable[[Work], str]) -> None:
        """Body of the thread of a job."""
        try:
            job.result = make(replace(self._work, progress=job.progress, cancel=job.cancel))
        except Cancelled:
            job.problem = "cancelled; nothing was written"
        except FracsliceError as error:
            job.problem = str(error)
        except MemoryError:
            job.problem = "there is not enough memory for it"

    def _file(self, path: Path, scene: Scene, camera: Camera, options: dict[str, Any], work: Work) -> str:
        """Make a picture, a film, a mesh, layers or a notebook."""
        from ..api.calls import make_mesh, render

        ending = path.suffix.lower()
        if ending in IMAGES:
            seen = replace(scene, view=replace(scene.view, camera=camera))
            how: dict[str, Any] = {"progress": work.progress, "cancel": work.cancel, "threads": work.threads}
            render(seen, **options, **how).save(path)
            return f"{path.name} is written"
        if ending in PRINT_ENDINGS:
            return self.inside.write_layers(path, scene, work)
        if ending == NOTEBOOK:
            write_notebook(path, to_xml(scene), options["resolution"])
            return f"{path.name} is written"
        if ending in FILMS:
            return self._film_of(path, scene, options["samples"], work)
        report = make_mesh(scene, work=work, path=path, **options).report
        verdict = f", would not print: {', '.join(report.problems)}" if report.problems else ""
        return f"{path.name}: {report.mesh.triangles:,} triangles{verdict}"

    def _film_of(self, path: Path, scene: Scene, samples: int, work: Work) -> str:
        """Make the frames of a film that are not there yet, and its file."""
        film, rate = Timeline(scene), scene.animation.fps if scene.animation else 0.0
        check_film(path, rate)
        size = scene.view.film.width, scene.view.film.height
        frames = FilmJob(film, size, samples, rate, device=self._device)
        folder = path.with_suffix(".frames")
        resume = has_frames(frames, folder)
        encode(write_frames(frames, range(frames.frames), folder, resume, work), path, rate, work)
        return f"{path.name}: {frames.frames} frames"


def _unseen(scene: Scene) -> tuple[Node, View]:
    """What of a scene a picture is of, but for the camera."""
    return scene.root, replace(scene.view, camera=None)


def command(target: Path, name: str, options: dict[str, Any]) -> str:
    """Command line that makes the same file; none makes notebooks."""
    ending = Path(name).suffix.lower()
    if ending == NOTEBOOK:
        return ""
    verbs = {"render": IMAGES, "animate": FILMS, "slice": PRINT_ENDINGS}
    verb = next((verb for verb, endings in verbs.items() if ending in endings), "mesh")
    given = "".join(f" --{option} {value}" for option, value in options.items())
    return f"fracslice {verb} {target.name} -o {name}{given}"


def opened(source: str, folder: Path, files_outside: bool) -> tuple[Document, Path]:
    """Document of a scene, or of a model as the scene of that alone, and the file to save it in."""
    path = Path(source)
    if path.suffix.lower() in SOLIDS:
        name, place = SOLIDS[path.suffix.lower()], path.with_suffix(".xml")
        text = f'<scene version="1">\n  <solid unit="1mm">\n    <{name} file="{escape(path.name)}"/>\n'
        return Document(f"{text}  </solid>\n</scene>\n", place, files_outside), folder / place.name
    file = library.file_of(source)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{source}: {getattr(error, 'strerror', None) or error}") from None
    return Document(text, file, files_outside), path if file == path else folder / file.name


def thumbnail(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture made as small as `THUMBNAIL`, uint8 [height, width, 3]."""
    from PIL import Image

    image = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
    image.thumbnail(THUMBNAIL)
    return np.asarray(image)


def jpeg(pixels: NDArray[np.uint8], quality: int) -> bytes:
    """Encode a picture, uint8 [height, width, 3], for a page."""
    import io

    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(pixels[..., :3]).save(file, "JPEG", quality=quality)
    return file.getvalue()
