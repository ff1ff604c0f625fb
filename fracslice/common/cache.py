"""Cache: files in folders that no other user can write to, the keys that name them, and the marks that
seal them.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import BinaryIO, TypeVar

import numpy as np

from ..errors import ExportError, FracsliceWarning
from .files import OWNER_ONLY, NotPrivateError, open_private, private_folder, replacing, reporting_errors

T = TypeVar("T")


@dataclass(frozen=True)
class Kept:
    """Cache files in a folder that no other user can write to.

    A folder or file that others can write to is ignored, with one warning.
    """

    folder: Path  # cache folder, created at first use for this user alone

    def get(self, name: str, read: Callable[[BinaryIO], T]) -> T | None:
        """Read a cached file."""
        return self._trusted(lambda here: self._read(name, read, here))

    def place(self) -> Path | None:
        """Return the path of the folder, for what needs one; None if others can write to it."""
        return self._trusted(lambda _: Path(os.path.realpath(self.folder)))

    def put(self, name: str, write: Callable[[BinaryIO], object]) -> None:
        """Write a cached file atomically; ignore a folder that is not trusted."""
        target = Path(os.path.realpath(self.folder), name)
        with (
            reporting_errors(self.folder),
            suppress(NotPrivateError),
            private_folder(self.folder),
            replacing(target, OWNER_ONLY) as file,
        ):
            write(file)

    def cached(self, name: str, make: Callable[[], bytes]) -> bytes:
        """Read a cached file with a checksum; without one, or if it is damaged, make and cache its
        contents.
        """
        data = self.get(name, lambda file: _verify(name, file))
        if data is None:
            data = make()
            self.put_checked(name, data)
        return data

    def put_checked(self, name: str, data: bytes) -> None:
        """Replace a cached file of `cached`; ignore a folder that cannot be written."""
        with suppress(ExportError):
            self.put(name, lambda file: file.write(_digest(name, data) + data))

    def _read(self, name: str, read: Callable[[BinaryIO], T], here: int | None) -> T:
        with open_private(self.folder / name, "rb", folder=here) as file:
            return read(file)

    def _trusted(self, use: Callable[[int | None], T]) -> T | None:
        """Result for the open folder; None if it cannot be opened or is not trusted."""
        try:
            with private_folder(self.folder) as here:
                return use(here)
        except NotPrivateError as error:
            warn(f"{error}: the files in {self.folder} are not used")
        except OSError:
            pass
        return None


def _digest(name: str, data: bytes) -> bytes:
    """Checksum of a file's name and contents: a file under another name is not taken for its own."""
    return hashlib.sha256(name.encode() + b"\0" + data).digest()


def _verify(name: str, file: BinaryIO) -> bytes | None:
    """Contents after their checksum; None if they do not match."""
    digest, data = file.read(hashlib.sha256().digest_size), file.read()
    return data if _digest(name, data) == digest else None


@cache
def warn(text: str) -> None:
    """Issue a `FracsliceWarning` once."""
    warnings.warn(text, FracsliceWarning, stacklevel=2)


def users_folder(variable: str, default: str) -> Path:
    """Return the folder of this program within one of the user's folders."""
    base = os.path.expanduser(os.environ.get(variable) or default)
    return Path(base if os.path.isabs(base) else os.devnull, "fracslice")


def cache_folder() -> Path:
    """Return the cache folder of kernels: $FRACSLICE_CACHE, else one in the user's cache folder."""
    given = os.environ.get("FRACSLICE_CACHE")
    return Path(given).expanduser() if given else users_folder("XDG_CACHE_HOME", "~/.cache") / "kernels"


PACKAGE = Path(__file__).parents[1]


def key(*parts: object) -> str:
    """Hash some values: equal for equal values in the same order, different otherwise.

    Returns 32 hexadecimal digits.
    """
    digest = hashlib.sha256()
    for part in parts:
        for data in _identity(part):
            digest.update(len(data).to_bytes(8, "little"))
            digest.update(data)
    return digest.hexdigest()[:32]


def _identity(part: object) -> tuple[bytes | memoryview, ...]:
    """Bytes that identify a value: type and shape, then contents."""
    if isinstance(part, np.ndarray):
        array = np.ascontiguousarray(part)
        return f"{part.dtype.str} {part.shape}".encode(), array.reshape(-1).view(np.uint8).data
    return (b"bytes", part) if isinstance(part, bytes) else (b"", repr(part).encode())


def texts(*paths: Path) -> str:
    """Hash the contents of files."""
    return key(*(path.read_bytes() for path in paths))


@cache
def program() -> str:
    """Hash the program, its native modules and the libraries that it computes with.

    The hash is cached for the sizes, times and inodes of the files: reading hundreds of files takes a tenth
    of a small slice job.
    """
    native = (find_spec(f"fracslice.{name}") for name in ("_native", "_slices", "_vdb"))
    compiled = (module.origin for module in native if module and module.origin)
    scipy = find_spec("scipy")  # importing it for its version takes longer than hashing the program
    assert scipy and scipy.origin
    files = [*_sources(str(PACKAGE)), *compiled, os.path.join(os.path.dirname(scipy.origin), "version.py")]
    states = [(f, s.st_size, s.st_mtime_ns, s.st_ctime_ns, s.st_ino) for f in files for s in (os.stat(f),)]
    kept = Kept(cache_folder() / "programs")

    def hashed() -> bytes:
        return key(texts(*map(Path, files)), np.__version__).encode()

    return kept.cached(f"{key(states, np.__version__)}.txt", hashed).decode()


def _sources(folder: str) -> list[str]:
    """Python files of a folder and its folders, sorted by folder."""
    entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    own = [entry.path for entry in entries if entry.name.endswith(".py")]
    return own + [path for entry in entries if entry.is_dir() for path in _sources(entry.path)]


SIZE = 32
"""Length of the secret, bytes."""


def seal(text: str) -> str:
    """Return the mark of a text: its hash, keyed by this user's secret.

    Returns BLAKE2b digest of 16 bytes.
    """
    return hashlib.blake2b(text.encode(), key=_secret(), digest_size=16).hexdigest()


@cache
def _secret() -> bytes:
    """Secret of this user, the same in every process, stored in the user's configuration folder."""
    kept = Kept(users_folder("XDG_CONFIG_HOME", "~/.config"))
    secret = kept.get("secret", lambda file: file.read())
    if secret is None or len(secret) != SIZE:
        secret = secrets.token_bytes(SIZE)
        try:
            kept.put("secret", lambda file: file.write(secret))
        except ExportError as error:
            warn(f"{error}: interrupted jobs will not go on")
    return secret
