"""Where compiled code is kept between starts, and what is believed of what lies there.

Numba keeps compiled code as pickles, and whoever loads one runs what it says. So a folder is used only if it is the user's own
and nobody else may write there, and a file begins with the SHA-256 of its place and the rest. A file
that was cut short, changed, or exchanged for another is removed, and its code is compiled again.
"""

from __future__ import annotations

import errno
import hashlib
import os
import stat
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Final

import numba
import platformdirs

from baldwinlab.core.files import write_atomically
from baldwinlab.engine import simd
from baldwinlab.engine.numba_internals.dispatchers import CodeStore

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

DIGEST: Final = hashlib.sha256().digest_size
ENDING: Final = ".compiled"


@cache
def sources_hash() -> str:
    """Hash what compiled code depends on: the sources, the version of Numba, and the lanes of a block."""
    digest = hashlib.sha256(f"numba {numba.__version__}, {simd.WIDTH} lanes".encode())
    package = Path(__file__).parents[1]
    for room in ("engine", "evolution", "models", "parts"):
        for source in sorted((package / room).rglob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


@cache
def cache_directory(code: str) -> Path | None:
    """Where compiled code with that fingerprint is kept; None, with a warning, where there is no place for any.

    In `$BALDWINLAB_CACHE`; where that is not set, in the user's cache folder, or (where that cannot be used) a temporary one
    of the user's own.
    """
    found = place()
    return found and found / code


@cache
def place() -> Path | None:
    """The folder of all compiled code of these sources, as `cache_directory` says."""
    chosen = os.environ.get("BALDWINLAB_CACHE")
    temporary = (
        Path(tempfile.gettempdir())
        / f"baldwinlab-{os.getuid() if hasattr(os, 'getuid') else 'cache'}"
    )
    reasons = []
    for candidate in (
        [Path(chosen)] if chosen else [Path(platformdirs.user_cache_dir("baldwinlab")), temporary]
    ):
        directory = candidate / f"engine-{sources_hash()}"
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            reason = _mistrusted(candidate) or _mistrusted(directory)
        except OSError as error:
            reason = f"{candidate} cannot be used ({error.strerror})"
        if reason is None:
            return directory
        reasons.append(reason)
    warnings.warn(
        f"compiled code is not kept for the next start: {'; '.join(reasons)}",
        RuntimeWarning,
        stacklevel=2,
    )
    return None


def _mistrusted(directory: Path) -> str | None:
    """Why code in a folder is not to be run, in part of a sentence; None if the folder is the user's alone to write."""
    if not hasattr(os, "getuid"):
        return None  # Windows: a user's folders are the user's by inheritance
    own = directory.stat()
    if own.st_uid != os.getuid():
        return f"{directory} belongs to another user"
    if own.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"others than you may write to {directory} (chmod go-w makes it your own)"
    parents = directory.absolute().parents
    trusted = {
        os.getuid(),
        parents[-1].stat().st_uid,
    }  # whoever owns the root folder is the machine's administrator
    for parent in parents:
        found = parent.stat()
        if found.st_uid not in trusted or (
            found.st_mode & stat.S_IWOTH and not found.st_mode & stat.S_ISVTX
        ):
            return f"others may put another folder in the place of {directory}, for {parent} is theirs to write"
    return None if os.access(directory, os.W_OK) else f"{directory} cannot be written to"


class Store(CodeStore):
    """What a dispatcher of Numba's finds compiled code in, and leaves it in: a folder with a file for each signature."""

    def __init__(self, directory: Path) -> None:
        self.cache_path = str(directory)
        self._directory = directory

    def read(self, key: str) -> bytes | None:
        """What is stored under a key; None if there is nothing, or not what was written."""
        path = self._path(key)
        try:
            raw = path.read_bytes()
        except OSError:
            return None
        if self._digest(key, raw[DIGEST:]) != raw[:DIGEST]:
            self.discard(key)
            return None
        return raw[DIGEST:]

    def write(self, key: str, content: bytes) -> None:
        """Store compiled code; a warning says where that is not possible."""
        path = self._path(key)
        try:
            self._directory.mkdir(mode=0o700, exist_ok=True)
            write_atomically(path, self._digest(key, content) + content)
        except OSError as error:
            _not_kept(self._directory.parent, error.errno or errno.EIO)

    def discard(self, key: str) -> None:
        """Remove what is stored under a key, so that it is compiled again."""
        self._path(key).unlink(missing_ok=True)

    def _digest(self, key: str, content: bytes) -> bytes:
        """Return the SHA-256 of code and its place: of two exchanged files, neither fits its own."""
        return hashlib.sha256(f"{self._directory.name}/{key}\n".encode() + content).digest()

    def _path(self, key: str) -> Path:
        return self._directory / f"{key}{ENDING}"


@contextmanager
def alone(directory: Path | None) -> Iterator[None]:
    """Of all processes that compile what is to be kept there, one at a time: who waited for another finds it made."""
    with ExitStack() as held:
        if directory is not None and fcntl is not None and not _holds_code(directory):
            with suppress(
                OSError
            ):  # a folder that cannot be locked, or written to: each compiles for itself
                directory.mkdir(mode=0o700, exist_ok=True)
                fcntl.flock(held.enter_context((directory / "lock").open("w")), fcntl.LOCK_EX)
        yield


@cache
def _not_kept(directory: Path, number: int) -> None:
    """Say it once, not of every function."""
    why = f"compiled code is not kept for the next start: {directory}: {os.strerror(number)}"
    warnings.warn(why, RuntimeWarning, stacklevel=3)


def is_kept(code: str) -> bool:
    """Whether code with that fingerprint has been compiled, by an earlier process."""
    directory = cache_directory(code)
    return directory is not None and _holds_code(directory)


def _holds_code(directory: Path) -> bool:
    return any(directory.glob(f"*{ENDING}"))
