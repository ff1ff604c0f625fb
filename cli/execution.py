"""Execution of a command: threads, progress bar and orderly cancellation by Ctrl-C; its inputs and
outputs.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Container, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from fracslice.errors import Cancelled, FracsliceError, KeptError, MeshError, SceneError
from fracslice.formats import ENDINGS, SOLIDS

if TYPE_CHECKING:
    from fracslice.mesh import Mesh
    from fracslice.scene import Scene
    from fracslice.work import Work


Progress = Callable[[str, float], None]

NOTHING = "nothing was written"
"""What most commands leave when they are stopped."""


class StoppedError(FracsliceError):
    """A signal stopped the work."""

    def __init__(self, number: int, kept: str) -> None:
        super().__init__(f"stopped; {kept}")
        self.status = 128 + number


@contextmanager
def working(how: int | Work, quiet: bool, kept: str = NOTHING) -> Iterator[Work]:
    """Work that shows its progress on a terminal and is cancelled by SIGINT and SIGTERM."""
    from fracslice.work import Work

    like = Work(how) if isinstance(how, int) else how
    with _bar(quiet) as progress, _cancelled_by_signals(kept) as cancel:
        yield replace(like, progress=progress, cancel=cancel)


@contextmanager
def _bar(quiet: bool) -> Iterator[Progress]:
    """Progress bar on stderr; without a terminal, a function that does nothing."""
    if quiet or not sys.stderr.isatty():
        yield lambda stage, done: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:>10}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks = {}
        preparing = bar.add_task("preparing", total=None)  # the first run of a scene compiles for a second

        def progress(stage: str, done: float) -> None:
            bar.update(preparing, visible=False)
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=1.0)
            bar.update(tasks[stage], completed=done)

        yield progress


@contextmanager
def _cancelled_by_signals(kept: str) -> Iterator[threading.Event]:
    """Event set by the first SIGINT or SIGTERM; the second one raises KeyboardInterrupt at once."""
    cancel = threading.Event()
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        cancel.set()
        if len(received) > 1:
            raise KeyboardInterrupt

    try:
        with _handled_by(stop):
            yield cancel
    except KeptError as error:
        raise StoppedError(received[0] if received else signal.SIGINT, str(error)) from None
    except Cancelled:
        raise StoppedError(received[0] if received else signal.SIGINT, kept) from None


@contextmanager
def stopped_at_once() -> Iterator[None]:
    """Let the first SIGINT or SIGTERM end what is done within, which looks at no cancellation."""
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    try:
        with _handled_by(stop):
            yield
    except BaseException:
        if not received:
            raise
    if received:  # also where a parser went on after the exception
        raise StoppedError(received[0], NOTHING)


@contextmanager
def _handled_by(stop: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Handle SIGINT and SIGTERM within."""
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class BadInput(click.ClickException):
    """The input of a command cannot be used."""

    exit_code = 2


def scene_path(source: str) -> Path:
    """Path of a scene file, or of the shipped scene of that name if there is no such file.

    Raises `BadInput` for a model file.
    """
    from fracslice.scene import library

    if is_model(source) and Path(source).is_file():
        raise BadInput(f"{source}: expected a scene, found a model")
    bare = Path(source).name == source and not Path(source).suffix
    return Path(source) if Path(source).exists() or not bare else library.path(source)


def load_scene(source: str, settings: Iterable[str] = ()) -> Scene:
    """Read the scene of a command, or that of a model file, and apply the values of --set."""
    with stopped_at_once():
        return _scene(source).with_values(settings)


def _scene(source: str) -> Scene:
    """Scene of a file or a name; of a model or a grid the scene of that alone, in mm."""
    from fracslice.scene import read

    if formula := SOLIDS.get(Path(source).suffix.lower()):
        from fracslice.formulas import get
        from fracslice.scene import scene

        try:
            solid = get(formula)(source, place="as is", units="mm")
            return scene(solid, unit=1.0, name=Path(source).stem)
        except SceneError as error:
            raise BadInput(f"{source}: {error.__cause__ or error}") from error
    outside = click.get_current_context().params.get("allow_files_outside", False)
    return read(scene_path(source), files_outside=outside)


def refuse_moved(scene: Scene, settings: Iterable[str]) -> None:
    """Raise `BadInput` for a setting of an attribute that a track moves: it would have no effect."""
    moved = {"".join(track.of.split()) for track in scene.tracks}
    for setting in settings:
        if "".join(setting.partition("=")[0].split()) in moved:
            raise BadInput(f"{setting}: a <track> moves it; expected another attribute, or other keys")


def is_model(source: str) -> bool:
    """True if the file name has the extension of a model."""
    return Path(source).suffix.lower() in ENDINGS


def load_model(source: str) -> Mesh:
    """Read the mesh of a model file. Raises `BadInput` if it cannot be read."""
    from fracslice.mesh.models import read_mesh

    try:
        with stopped_at_once():
            return read_mesh(source)
    except MeshError as error:
        raise BadInput(str(error)) from error


def refuse_options(names: Container[str], why: str) -> None:
    """Raise a usage error for a given option that has no effect here."""
    context = click.get_current_context()
    for option in context.command.params:
        name = str(option.name)
        given = context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE
        if given and name in names:
            raise click.UsageError(f"{option.opts[-1]}: {why}")


def check_targets(source: str, *targets: str | None) -> None:
    """Check output files before any work is done.

    Raises an error for a file that cannot be written, or that would replace the scene or another output.
    """
    from fracslice.common.files import check_target

    taken = {os.path.realpath(source)}
    for target in targets:
        if target is None:
            continue
        if os.path.realpath(target) in taken:
            raise click.UsageError(f"{target}: expected another file; this one is named twice")
        taken.add(os.path.realpath(target))
        check_target(target)


def check_folder(folder: Path) -> None:
    """Check before any work is done that a folder can be made or written to."""
    from fracslice.common.files import check_target

    if folder.exists() and not folder.is_dir():
        raise click.UsageError(f"{folder}: expected a folder")
    check_target(folder / "a file" if folder.is_dir() else folder)
