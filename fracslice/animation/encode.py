"""Film files from numbered frames: ffmpeg for films, Pillow for animated pictures and contact sheets."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..common.files import replacing, temporary_folder
from ..common.messages import lacking
from ..errors import ExportError
from ..work import Work

CODECS = {
    ".mp4": ("libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"),
    ".webm": ("libvpx-vp9", "-pix_fmt", "yuv420p", "-crf", "24", "-b:v", "0", "-row-mt", "1"),
    ".mov": ("prores_ks", "-profile:v", "3", "-pix_fmt", "yuv422p10le"),
    ".mkv": ("libsvtav1", "-pix_fmt", "yuv420p", "-crf", "28", "-preset", "6"),
}
"""Codec and options of ffmpeg by ending: H.264, VP9, ProRes 422 HQ and AV1."""
COLOURS = ("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv")
"""Tags of a film's colours: a player guesses the matrix of a film without them by its size."""
ALIKE = ("-fflags", "+bitexact")
"""No random identity in .webm and .mkv: the same frames are the same file."""
COLUMNS, ROWS, THUMBNAIL = 6, 4, 240
"""Pictures of a contact sheet, and their width in pixels."""
FASTEST_GIF = 50.0
"""Most frames per second of a .gif: browsers take a frame of a hundredth of a second for one of a tenth."""
ENDINGS = (*CODECS, ".gif", ".apng", ".png")


def check_film(path: Path, fps: float) -> None:
    """Check that a film file can be made.

    Parameters
    ----------
    path : Path
        The file.
    fps : float
        Frames per second.

    Raises
    ------
    ExportError
        For an unknown ending, a missing imageio-ffmpeg, or too many frames per second.
    """
    if path.suffix.lower() not in ENDINGS:
        raise ExportError(f"{path}: unknown kind of film; known are {', '.join(ENDINGS)}, and a folder")
    missing = lacking("imageio_ffmpeg", f"{path.suffix} films need", "imageio-ffmpeg")
    if path.suffix.lower() in CODECS and missing:
        raise ExportError(missing)
    if path.suffix.lower() == ".gif" and fps > FASTEST_GIF:
        raise ExportError(f"{path}: {fps:g} frames per second: expected at most {FASTEST_GIF:g} for .gif")


def encode(frames: Sequence[Path], path: Path, fps: float, work: Work) -> None:
    """Write frames as one file, by its ending: a film, an animated picture, or a contact sheet (.png).

    Parameters
    ----------
    frames : sequence of Path
        PNG files, in order.
    path : Path
        The file.
    fps : float
        Frames per second.
    work : Work
        Progress and cancellation.

    Raises
    ------
    ExportError
        If the file cannot be made.
    Cancelled
        When the work is cancelled.
    """
    check_film(path, fps)
    ending = path.suffix.lower()
    pictures = _pictures(frames, work)
    with replacing(path) as file:
        if ending in CODECS:
            file.write(_encode_film(pictures, ending, fps))
        elif ending == ".png":
            _contact_sheet(pictures, len(frames)).save(file, "png")
        elif ending == ".gif":
            first, *others = map(_of_few_colours, pictures)
            times = _hundredths(len(frames), fps)
            first.save(file, "gif", save_all=True, append_images=others, duration=times, loop=0)
        else:
            first, *others = pictures
            first.save(file, "png", save_all=True, append_images=others, duration=1000 / fps, loop=0)


def sheet_frames(frames: Sequence[int]) -> list[int]:
    """Choose the frames of a contact sheet, at equal intervals.

    Parameters
    ----------
    frames : sequence of int
        Numbers of the frames of a film.

    Returns
    -------
    list of int
        At most `COLUMNS` x `ROWS` of them, the first and the last one included.
    """
    count = min(COLUMNS * ROWS, len(frames))
    return [frames[k * (len(frames) - 1) // max(count - 1, 1)] for k in range(count)]


def _contact_sheet(pictures: Iterator[Any], count: int) -> Any:
    """Sheet of pictures in rows."""
    from PIL import Image

    sheet = None
    for k, picture in enumerate(pictures):
        width = min(THUMBNAIL, picture.width)
        height = max(round(width * picture.height / picture.width), 1)
        sheet = sheet or Image.new("RGB", (width * min(COLUMNS, count), height * -(-count // COLUMNS)))
        small = picture.resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(small, (k % COLUMNS * width, k // COLUMNS * height))
    return sheet


def _hundredths(count: int, fps: float) -> list[int]:
    """Milliseconds of each frame of a .gif: whole hundredths of a second, whose sum is the film's."""
    ends = [10 * round(100 * k / fps) for k in range(count + 1)]
    return [after - before for before, after in pairwise(ends)]


def _of_few_colours(picture: Any) -> Any:
    """Picture of 256 colours: means of clusters, since a median cut leaves few to what is small and vivid."""
    return picture.quantize(kmeans=max(picture.width * picture.height // 100, 1))


def _pictures(frames: Sequence[Path], work: Work) -> Iterator[Any]:
    """Pictures of the frames, one by one."""
    for done, frame in enumerate(frames, 1):
        work.check()
        yield _open_picture(frame)
        work.progress("film", done / len(frames))


def _open_picture(path: Path) -> Any:
    """Picture of a file; the file is closed."""
    from PIL import Image

    with Image.open(path) as picture:
        return picture.convert("RGB")


def _encode_film(pictures: Iterator[Any], ending: str, fps: float) -> bytes:
    """Film made by ffmpeg, in a process of its own."""
    import imageio_ffmpeg

    first = _even(next(pictures))
    height, width, _ = first.shape
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-framerate", repr(fps)]
    codec, *options = CODECS[ending]
    with temporary_folder() as folder, tempfile.TemporaryFile() as log:
        film = folder / f"film{ending}"
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", *source, "-i", "-"]
        command += ["-vf", "scale=out_color_matrix=bt709", "-c:v", codec, *options, *COLOURS]
        command += [*ALIKE, str(film)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log) as process:
            assert process.stdin
            try:
                for pixels in chain([first], map(_even, pictures)):
                    process.stdin.write(pixels.tobytes())
            except BrokenPipeError:  # ffmpeg's own message says more
                pass
            except BaseException:
                process.kill()
                raise
        if process.returncode:
            log.seek(0)
            lines = log.read().decode(errors="replace").split("\n")
            raise ExportError(f"ffmpeg: {next(filter(None, reversed(lines)), 'failed')}")
        return film.read_bytes()


def _even(picture: Any) -> np.ndarray:
    """Pixels of a picture; the last row or column is repeated for even sides, as the codecs need."""
    pixels = np.asarray(picture)
    height, width, _ = pixels.shape
    return np.pad(pixels, ((0, height % 2), (0, width % 2), (0, 0)), "edge")
