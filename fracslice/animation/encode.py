"""Film files from numbered frames: ffmpeg for films, Pillow for animated pictures and contact sheets."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..common.extras import lacking
from ..errors import ExportError
from ..export import replacing

CODECS = {
    ".mp4": ("libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"),
    ".webm": ("libvpx-vp9", "-pix_fmt", "yuv420p", "-crf", "24", "-b:v", "0", "-row-mt", "1"),
    ".mov": ("prores_ks", "-profile:v", "3", "-pix_fmt", "yuv422p10le"),
    ".mkv": ("libsvtav1", "-pix_fmt", "yuv420p", "-crf", "28", "-preset", "6"),
}
"""Codec and options of ffmpeg by ending: H.264, VP9, ProRes 422 HQ and AV1."""
COLUMNS, ROWS, THUMBNAIL = 6, 4, 240
"""Pictures of a contact sheet, and their width in pixels."""
ENDINGS = (*CODECS, ".gif", ".apng", ".png")


def check_film(path: Path) -> None:
    """Check that a film file can be made.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    ExportError
        For an unknown ending, or a missing imageio-ffmpeg.
    """
    if path.suffix.lower() not in ENDINGS:
        raise ExportError(f"{path}: unknown kind of film; known are {', '.join(ENDINGS)}, and a folder")
    missing = lacking("imageio_ffmpeg", f"{path.suffix} films need", "imageio-ffmpeg")
    if path.suffix.lower() in CODECS and missing:
        raise ExportError(missing)


def encode(frames: Sequence[Path], path: Path, fps: float) -> None:
    """Write frames as one file, by its ending: a film, an animated picture, or a contact sheet (.png).

    Parameters
    ----------
    frames : sequence of Path
        PNG files, in order.
    path : Path
        The file.
    fps : float
        Frames per second.

    Raises
    ------
    ExportError
        If the file cannot be made.
    """
    check_film(path)
    ending = path.suffix.lower()
    with replacing(path) as file:
        if ending in CODECS:
            file.write(_encoded(frames, ending, fps))
        elif ending == ".png":
            contact_sheet(frames).save(file, "png")
        else:
            first, *others = map(_opened, frames)
            form = "gif" if ending == ".gif" else "png"
            first.save(file, form, save_all=True, append_images=others, duration=1000 / fps, loop=0)


def contact_sheet(frames: Sequence[Path]) -> Any:
    """Return a sheet of frames at equal intervals.

    Parameters
    ----------
    frames : sequence of Path
        PNG files, in order.

    Returns
    -------
    PIL.Image.Image
        At most `COLUMNS` x `ROWS` pictures.
    """
    from PIL import Image

    count = min(COLUMNS * ROWS, len(frames))
    chosen = [_opened(frames[k * (len(frames) - 1) // max(count - 1, 1)]) for k in range(count)]
    width = min(THUMBNAIL, chosen[0].width)
    height = max(round(width * chosen[0].height / chosen[0].width), 1)
    sheet = Image.new("RGB", (width * min(COLUMNS, count), height * -(-count // COLUMNS)))
    for k, picture in enumerate(chosen):
        small = picture.resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(small, (k % COLUMNS * width, k // COLUMNS * height))
    return sheet


def _opened(path: Path) -> Any:
    """Picture of a file; the file is closed."""
    from PIL import Image

    with Image.open(path) as picture:
        return picture.convert("RGB")


def _encoded(frames: Sequence[Path], ending: str, fps: float) -> bytes:
    """Film made by ffmpeg, in a process of its own; odd sides get a black row, as the codecs need."""
    import imageio_ffmpeg

    width, height = _opened(frames[0]).size
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-framerate", repr(fps)]
    codec, *options = CODECS[ending]
    with tempfile.TemporaryDirectory(prefix="fracslice-") as folder, tempfile.TemporaryFile() as log:
        film = Path(folder) / f"film{ending}"
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", *source, "-i", "-"]
        command += ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", codec, *options, str(film)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log) as process:
            assert process.stdin
            with suppress(BrokenPipeError):  # ffmpeg's own message says more
                for frame in frames:
                    process.stdin.write(_opened(frame).tobytes())
        if process.returncode:
            log.seek(0)
            lines = log.read().decode(errors="replace").split("\n")
            raise ExportError(f"ffmpeg: {next(filter(None, reversed(lines)), 'failed')}")
        return film.read_bytes()
