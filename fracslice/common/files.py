"""Files: atomic and flushed writes, locks against other processes, files that no other user can have
written, and packages of 3MF: ZIP archives with a model as text, in one stream or joined from deflated
blocks.

Windows has neither the permissions nor the flags that this checks; there, folders in the user's profile are
private by inheritance.
"""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
import threading
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING, Any, BinaryIO, Literal, NamedTuple

import numpy as np
from isal.isal_zlib import crc32, crc32_combine
from numpy.typing import NDArray

from ..errors import ExportError

if TYPE_CHECKING:
    from PIL.Image import Image

try:
    import grp
    import pwd

    POSIX = True
except ImportError:
    POSIX = False

OWNER_ONLY, BY_OTHERS = 0o600, 0o022
NO_LINK = getattr(os, "O_NOFOLLOW", 0)
NO_WAIT = getattr(os, "O_NONBLOCK", 0)
"""Flag without which opening a pipe would block."""


class NotPrivateError(PermissionError):
    """Another user can write to this place."""


@contextmanager
def open_private(
    path: str | Path,
    mode: Literal["rb", "r+b"],
    flags: int = 0,
    folder: int | None = None,
    buffering: int = -1,
) -> Iterator[BinaryIO]:
    """Open a file that no other user can write; do not follow a symbolic link."""

    def opener(name: str, by_mode: int) -> int:
        return os.open(name, by_mode | flags | NO_LINK | NO_WAIT, OWNER_ONLY, dir_fd=folder)

    with open(path if folder is None else Path(path).name, mode, buffering, opener=opener) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or not _is_private(status):
            raise NotPrivateError(f"{path}: others can write this file")
        yield file


@contextmanager
def open_regular(path: str | Path) -> Iterator[BinaryIO]:
    """Open a file to read; refuse a pipe or a device, which may never end, with an `OSError`."""
    with open(path, "rb", opener=lambda name, mode: os.open(name, mode | NO_WAIT)) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "expected a file, found a pipe or a device", os.fspath(path))
        yield file


MOST_PIXELS = 1 << 26
"""Most pixels of a picture that is read."""


def open_picture(file: BinaryIO, formats: tuple[str, ...]) -> Image:
    """Open a picture in some of Pillow's formats, of a size that can be read; its pixels are not read yet.

    Raises `ValueError` for too many pixels, and what Pillow raises.
    """
    from PIL import Image

    try:
        picture = Image.open(file, formats=formats)
    except Image.DecompressionBombError:  # its words are of an attack
        raise ValueError(f"too many pixels: expected at most {MOST_PIXELS} of them") from None
    require_pixels(*picture.size)
    return picture


def require_pixels(width: int, height: int) -> None:
    """Raise `ValueError` for a picture without pixels, or with too many."""
    if not 0 < width * height <= MOST_PIXELS:
        raise ValueError(f"{width} x {height} pixels: expected at most {MOST_PIXELS} of them")


def read_bytes(path: str | Path) -> bytes:
    """Contents of a file, which is opened as by `open_regular`."""
    with open_regular(path) as file:
        return file.read()


@contextmanager
def private_folder(folder: Path) -> Iterator[int | None]:
    """Open a folder whose contents and path no other user can change; create it if it does not exist.

    Descends from the root and keeps each folder open while it checks the next one, so that nothing already
    checked can be exchanged.
    """
    path = Path(os.path.realpath(folder))
    if not POSIX:
        path.mkdir(parents=True, exist_ok=True)
        yield None
        return
    here = _folder(path.anchor, None)
    try:
        for place in [*reversed(path.parents), path][1:]:
            if _lets_exchange(os.fstat(here)):
                raise NotPrivateError(f"{place.parent}: others can write in this folder")
            above, here = here, _folder(place.name, here)
            os.close(above)
        if not _is_private(os.fstat(here)):
            raise NotPrivateError(f"{path}: others can write in this folder")
        yield here
    finally:
        os.close(here)


def _folder(name: str, within: int | None) -> int:
    """Open a folder; create it for this user alone if it does not exist."""
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        return os.open(name, flags, dir_fd=within)
    except FileNotFoundError:
        with suppress(FileExistsError):
            os.mkdir(name, 0o700, dir_fd=within)
        return os.open(name, flags, dir_fd=within)


def _is_private(status: os.stat_result) -> bool:
    """True if no other user can write."""
    return not POSIX or (status.st_uid in _trusted_users() and not status.st_mode & BY_OTHERS)


def _trusted_users() -> tuple[int, int]:
    """User ids whose files are trusted: this user's and root's, which could change any file anyway."""
    return 0, os.geteuid()


def _lets_exchange(status: os.stat_result) -> bool:
    """True if others can replace an entry of this user in a folder."""
    others = status.st_mode & stat.S_IWOTH or (status.st_mode & stat.S_IWGRP and not _alone_in(status.st_gid))
    return status.st_uid not in _trusted_users() or bool(others and not status.st_mode & stat.S_ISVTX)


def _alone_in(group: int) -> bool:
    """True if a group is the user's private group. Debian creates one per user, with write permission on the
    user's files.
    """
    try:
        user, entry = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return (group, entry.gr_name) == (user.pw_gid, user.pw_name) and set(entry.gr_mem) <= {user.pw_name}


FLUSH_S = 0.05
"""Seconds between two flushes of a file that is being written; small ones are complete before the first."""

BUFFER = 1 << 20
"""Bytes of a file that are written at once: an archive has thousands of small members."""

LARGE = 1 << 26
"""Bytes of a replaced file that another thread releases."""


TEMPORARY = ".fracslice~"
"""Begin of the names of files and folders that are there while something is written, and locked."""

FULL = errno.ENOSPC, errno.EDQUOT
"""Errors of a full disk."""


@contextmanager
def reporting_errors(path: str | Path) -> Iterator[None]:
    """Raise errors of the file system as `ExportError`, with the path and the reason in one line."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        if error.errno in FULL:
            reason = "the disk is full; the file was not written"
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            reason = "not allowed to write there"
        raise ExportError(f"{path}: {reason}") from error


def check_target(path: str | Path) -> Path:
    """Check that a file can be written; nothing is changed.

    Parameters
    ----------
    path
        File to write.

    Returns
    -------
    Path
        The path with links resolved.

    Raises
    ------
    ExportError
        If the folder is missing or not writable, or if `path` is itself a folder, a device or a pipe.
    """
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        wrong = "is a file, not a folder" if target.parent.exists() else "does not exist"
        raise ExportError(f"{path}: the folder {target.parent} {wrong}")
    if target.is_dir():
        raise ExportError(f"{path}: is a folder")
    if target.exists() and not target.is_file():
        raise ExportError(f"{path}: is a device or a pipe; expected a file, which is replaced")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise ExportError(f"{path}: the folder {target.parent} is not writable")
    return target


@contextmanager
def replacing(path: str | Path, mode: int | None = None) -> Iterator[BinaryIO]:
    """Write a file atomically: it appears at `path` complete when the block ends, or not at all.

    The temporary file lies beside the target, with permissions for its owner only, and is flushed to disk
    before it is renamed. Any error, KeyboardInterrupt included, removes it.

    Parameters
    ----------
    path
        File to write.
    mode
        Permissions; by default those of the file that is replaced, or of a new file.

    Yields
    ------
    BinaryIO
        Temporary file, open for writing.

    Raises
    ------
    ExportError
        For an error of the file system.
    """
    target = check_target(path)

    def empty() -> str:
        handle, part = tempfile.mkstemp(f".{target.name[:100]}.part", TEMPORARY, target.parent)
        os.close(handle)
        return part

    with reporting_errors(path), _locked_new(empty, target.parent) as part:
        try:
            with open(part, "wb", BUFFER) as file:
                yield file
                file.flush()
                os.chmod(part, _permissions(target) if mode is None else mode)
                os.fsync(file.fileno())
            _replace(part, target)
        except BaseException:
            with suppress(FileNotFoundError):
                os.unlink(part)
            raise


@contextmanager
def temporary_folder(within: Path | None = None) -> Iterator[Path]:
    """Make a folder for a block, by default in that of the system.

    A process that is killed leaves it; the next one that writes there removes it.
    """
    place = within or Path(tempfile.gettempdir())
    with _locked_new(lambda: tempfile.mkdtemp(prefix=TEMPORARY, dir=place), place) as folder:
        try:
            yield Path(folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _locked_new(make: Callable[[], str], within: Path) -> Iterator[str]:
    """Make a temporary file or folder and lock it, so that no other process takes it for a leftover."""
    remove_leftovers(within)
    path, handle = _make_locked(make)
    try:
        yield path
    finally:
        if handle is not None:
            os.close(handle)


def _make_locked(make: Callable[[], str]) -> tuple[str, int | None]:
    """Path and handle; made again if another process removed it before it was locked."""
    path = make()
    if not POSIX:  # Windows moves no file that is open
        return path, None
    with suppress(FileNotFoundError):
        handle = os.open(path, os.O_RDONLY)
        with suppress(ExportError):
            lock(handle, path)
            if os.path.exists(path):
                return path, handle
        os.close(handle)
    return _make_locked(make)


def remove_leftovers(folder: Path) -> None:
    """Remove the temporary files and folders of processes that were killed: nobody has locked them."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(TEMPORARY):
                _remove_unlocked(entry.path)


def _remove_unlocked(path: str) -> None:
    with suppress(OSError, ExportError):
        handle = os.open(path, os.O_RDONLY | NO_LINK | NO_WAIT)
        try:
            if lock(handle, path):
                shutil.rmtree(path) if os.path.isdir(path) else os.unlink(path)
        finally:
            os.close(handle)


def link_or_copy(source: str, path: str | Path) -> None:
    """Give a complete file another name atomically; copy it where the file system cannot link it."""
    target = check_target(path)
    part = str(target.with_name(f".{target.name[:100]}.{token_hex(8)}.part"))
    try:
        with open(source, "rb") as file:
            os.link(source, part)
            os.chmod(part, _permissions(target))
            os.fsync(file.fileno())
        _replace(part, target)
        with suppress(FileNotFoundError):
            os.unlink(part)  # still there if it was the target's already: POSIX does not rename then
    except OSError:
        with suppress(FileNotFoundError):
            os.unlink(part)
        with replacing(path) as file, open(source, "rb") as whole:
            append_file(whole, file)


def append_file(source: BinaryIO, target: BinaryIO) -> int:
    """Append a file to another one, by the kernel where it can.

    Returns number of bytes.
    """
    count, copy = os.fstat(source.fileno()).st_size, getattr(os, "copy_file_range", None)
    with suppress(OSError):  # of memory, on other file systems, or in an old kernel
        target.flush()
        while copy and (done := copy(source.fileno(), target.fileno(), count, source.tell(), target.tell())):
            source.seek(done, os.SEEK_CUR)
            target.seek(done, os.SEEK_CUR)
    shutil.copyfileobj(source, target, 1 << 22)
    return count


@contextmanager
def flushing(file: BinaryIO) -> Iterator[None]:
    """Flush a file to disk again and again while a block writes it, so that little is left for the end.

    Parameters
    ----------
    file
        File, open for writing.

    Yields
    ------
    None
        While the file is flushed.

    Raises
    ------
    OSError
        For an error of the file system.
    """
    ended = threading.Event()

    def flush() -> None:
        while not ended.wait(FLUSH_S):
            os.fsync(file.fileno())

    with ThreadPoolExecutor(1) as pool:
        flushed = pool.submit(flush)
        try:
            yield
        finally:
            ended.set()
    flushed.result()


def write_small_file(path: str, data: bytes) -> None:
    """Write one of many files with as few system calls as possible, neither atomically nor flushed to disk.

    The caller must check the files that an interrupted job left before using them.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | NO_LINK | getattr(os, "O_BINARY", 0)
    handle = os.open(path, flags, 0o666)
    try:
        while data:
            data = data[os.write(handle, data) :]
    finally:
        os.close(handle)


def _permissions(target: Path) -> int:
    """Permissions of a file, or of a new one if it does not exist."""
    mask = os.umask(0o077)  # the umask cannot be read without setting it
    os.umask(mask)
    return target.stat().st_mode & 0o7777 if target.exists() else 0o666 & ~mask


def _replace(part: str, target: Path) -> None:
    """Move a file to its name; another thread releases a large one that had it."""
    old = _hold_open(target)
    try:
        os.replace(part, target)
        _flush_folder(target.parent)
    finally:
        if old is not None:
            threading.Thread(target=os.close, args=(old,)).start()


def _hold_open(target: Path) -> int | None:
    """Open a large file before it is replaced. It is released when closed, a third of a second per GB."""
    with suppress(OSError):
        if os.name == "posix" and target.stat().st_size >= LARGE:
            return os.open(target, os.O_RDONLY)
    return None


def _flush_folder(folder: Path) -> None:
    """Flush the folder's new entry to disk, where the system supports it."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def lock(handle: int, path: str | Path) -> bool:
    """Lock an open file or folder until it is closed; false where the file system has no locks."""
    try:
        try:
            import fcntl
        except ImportError:
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        raise ExportError(f"{path}: another process is writing it") from None
    except OSError:
        return False
    return True


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Lock a folder during a block, where the system can open folders."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        yield
        return
    try:
        lock(handle, folder)
        yield
    finally:
        os.close(handle)


LARGEST, LONGEST, DEEPEST = 1 << 20, 1 << 14, 8
"""Most bytes of such a file, characters of a TOML file, whose long keys take quadratic time, and tables and
arrays within each other."""


def read_text(path: Path, fail: type[Exception], errors: str = "strict") -> str:
    """Read a text file.

    `errors`: treatment of invalid bytes.
    """
    try:
        with open_regular(path) as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise fail(f"{path}: expected at most {LARGEST >> 20} MB of settings")
        return data.decode("utf-8", errors)
    except OSError as error:
        raise fail(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise fail(f"{path}: expected text in UTF-8") from None


def read_table(path: Path, fail: type[Exception]) -> dict[str, Any]:
    """Read a TOML file."""
    import tomllib  # of a user's own files

    text = read_text(path, fail)
    if len(text) > LONGEST:
        raise fail(f"{path}: expected at most {LONGEST >> 10} kB of settings")
    try:
        table = tomllib.loads(text)
        if _nested(table, DEEPEST):
            raise RecursionError
    except RecursionError:
        raise fail(f"{path}: expected at most {DEEPEST} tables and arrays within each other") from None
    except ValueError as error:  # of a number of thousands of digits, too
        raise fail(f"{path}: not a TOML file: {error}") from None
    return table


def _nested(value: Any, levels: int) -> bool:
    """True if tables and arrays lie within each other more than so many levels deep."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return bool(inner) and (not levels or any(_nested(part, levels - 1) for part in inner))


HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
TYPES = (
    HEAD + '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
RELATIONS = (
    HEAD + '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
CONTENT = "[Content_Types].xml"
SMALL = (CONTENT, TYPES.encode()), ("_rels/.rels", RELATIONS.encode())
"""Members of a package besides the model."""
THUMBNAIL = "Metadata/thumbnail.png"
SHOWN = (
    f'<Relationship Target="/{THUMBNAIL}" Id="thumbnail" '
    'Type="http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"/>'
)
KINDS = {"png": "image/png"}
"""Types of further members by their extensions; of others, plain text."""


def _small(more: Mapping[str, bytes], picture: bytes | None) -> dict[str, bytes]:
    """Members of a package besides the model, with further ones, and a picture of it as PNG."""
    more = {**more, **({} if picture is None else {THUMBNAIL: picture})}
    endings = sorted({name.rpartition(".")[2] for name in more})
    kinds = "".join(
        f'<Default Extension="{end}" ContentType="{KINDS.get(end, "text/plain")}"/>' for end in endings
    )
    shown = "" if picture is None else SHOWN
    relations = RELATIONS.replace("</Relationships>", f"{shown}</Relationships>").encode()
    return {CONTENT: TYPES.replace("</Types>", f"{kinds}</Types>").encode(), "_rels/.rels": relations, **more}


LEVEL = 3  # of deflate: a third of the time of the default 6, for files a twentieth larger

LAST_BLOCK = zlib.compressobj(wbits=-zlib.MAX_WBITS).flush()
"""Empty block that ends a deflate stream."""


class TextSum(NamedTuple):
    """Checksum and length of a text."""

    crc: int  # CRC-32, and bytes
    size: int


Fragment = Callable[[BinaryIO], TextSum]
"""Appends a text to a file, deflated and ended at a byte, so that another one may follow."""


def deflate(text: bytes) -> tuple[bytes, TextSum]:
    """Deflate a text by itself."""
    packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    blocks = packer.compress(text) + packer.flush(zlib.Z_FULL_FLUSH)
    return blocks, TextSum(crc32(text), len(text))


def append(blocks: tuple[bytes, TextSum], file: BinaryIO) -> TextSum:
    """Append a deflated text to a file; a `Fragment` once its first argument is given."""
    file.write(blocks[0])
    return blocks[1]


def combine_checksums(one: TextSum, other: TextSum) -> TextSum:
    """Checksum and length of two texts, one after the other."""
    return TextSum(crc32_combine(one.crc, other.crc, other.size), one.size + other.size)


def join(
    file: BinaryIO,
    fragments: Iterable[Fragment],
    is_large: bool,
    more: Mapping[str, bytes] | None = None,
    picture: bytes | None = None,
) -> None:
    """Write a package whose model is made of fragments. Its members carry no time.

    `more`: further members, texts by their names; `picture`: of the model, as PNG.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:
        for name, text in _small(more or {}, picture).items():
            archive.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_DEFLATED)
        info, whole = zipfile.ZipInfo("3D/3dmodel.model"), TextSum(0, 0)
        info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o600 << 16
        info.header_offset, info.CRC = file.tell(), 0
        file.write(info.FileHeader(is_large))
        start = file.tell()
        for fragment in fragments:
            whole = combine_checksums(whole, fragment(file))
        file.write(LAST_BLOCK)
        archive.start_dir = file.tell()
        info.CRC, info.file_size, info.compress_size = *whole, archive.start_dir - start
        file.seek(info.header_offset)
        file.write(info.FileHeader(is_large))
        file.seek(archive.start_dir)
        archive.filelist.append(info)


def package(file: BinaryIO, model: Iterable[bytes], is_large: bool, level: int) -> None:
    """Write a package with one model, deflated as one stream. Its members carry no time."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=level) as archive:
        for name, texts in (*((name, [text]) for name, text in SMALL), ("3D/3dmodel.model", model)):
            with archive.open(name, "w", force_zip64=is_large) as member:
                member.writelines(texts)


ROWS = 1 << 16
"""Rows of a block."""

Text = Callable[[], bytes]
"""Makes a part of a text."""


def number_rows(before: tuple[str, ...], end: str, values: NDArray[Any]) -> Iterator[Text]:
    """Format each row of a large array, in blocks that threads can make at once."""
    for begin in range(0, len(values), ROWS):
        yield partial(_block, before, end, values[begin : begin + ROWS])


def _block(before: tuple[str, ...], end: str, values: NDArray[Any]) -> bytes:
    from .._native import text_rows

    whole = values.dtype.kind in "iu"
    given: NDArray[Any] = np.ascontiguousarray(values, np.int64 if whole else np.float32)
    return text_rows(before, end, given)


def rows(template: str, values: NDArray[Any]) -> Iterator[bytes]:
    """Format each row of an array by a %-template, in blocks of bounded size.

    One formatting call per block is several times faster than one per row.
    """
    block = template * ROWS
    for begin in range(0, len(values), ROWS):
        part = values[begin : begin + ROWS]
        text = block if len(part) == ROWS else template * len(part)
        yield (text % tuple(part.ravel().tolist())).encode("ascii")
