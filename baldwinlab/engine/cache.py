"""The on-disk cache of compiled code, and the checks before code is loaded.

Numba stores compiled code as pickles, and loading a pickle can execute any code. So a folder is
used only if no other user can write to it. A file starts with the SHA-256 of the path and the
content. A truncated, changed or exchanged file is removed, and the code is compiled again.
"""

from __future__ import annotations

import errno
import hashlib
import os
import stat
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

import numba
import platformdirs

from baldwinlab.core.file_writing import write_atomically
from baldwinlab.engine import simd
from baldwinlab.engine.fingerprint import fingerprint, hash_files, hash_modules, list_modules
from baldwinlab.engine.numba_internals.dispatchers import CodeStore

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

DIGEST_BYTES: Final = hashlib.sha256().digest_size
CODE_SUFFIX: Final = ".compiled"
SOURCES_FILE: Final = "sources.json"

Functions = tuple[Callable[..., Any], ...]
"""An entry point, and the hooks and types of parts that it calls."""


@cache
def engine_hash() -> str:
    """Hash all sources of compiled code, the version of Numba, and the lanes of a SIMD block."""
    return _hash_text(f"{_compiler_hash()} {hash_files()}")


def _compiler_hash() -> str:
    return _hash_text(f"numba {numba.__version__}, {simd.WIDTH} lanes")


def _hash_text(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def cache_directory(functions: Functions) -> Path | None:
    """Return the cache folder of an entry point. Without a cache, warn and return None."""
    root = cache_root()
    return root and root / f"{fingerprint(functions)}-{hash_sources(functions)}"


def hash_sources(functions: Functions) -> str:
    """Hash the modules of functions, and all modules that they import."""
    root = cache_root()
    return hash_modules(list_modules(functions), root and root / SOURCES_FILE)


@cache
def cache_root() -> Path | None:
    """Return the cache folder of all compiled code. Without a cache, warn and return None.

    The cache is in `$BALDWINLAB_CACHE`. If the variable is not set, the cache is in the cache
    folder of the user, or in a temporary folder if the folder of the user cannot be used.
    """
    configured_folder = os.environ.get("BALDWINLAB_CACHE")
    owner = os.getuid() if hasattr(os, "getuid") else "cache"
    temporary = Path(tempfile.gettempdir()) / f"baldwinlab-{owner}"
    defaults = [Path(platformdirs.user_cache_dir("baldwinlab")), temporary]
    reasons = []
    candidates = [Path(configured_folder)] if configured_folder else defaults
    for candidate in candidates:
        directory = candidate / f"engine-{_compiler_hash()}"
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            reason = _why_untrusted(candidate) or _why_untrusted(directory)
        except OSError as error:
            reason = f"{candidate} cannot be used ({error.strerror})"
        if reason is None:
            return directory
        reasons.append(reason)
    warnings.warn(
        f"compiled code is not cached: {'; '.join(reasons)}",
        RuntimeWarning,
        stacklevel=2,
    )
    return None


def _why_untrusted(directory: Path) -> str | None:
    """Return why code in a folder must not be run, or None if only the user can write to it."""
    # On Windows, the folders of a user are writable only for the user.
    if not hasattr(os, "getuid"):
        return None
    status = directory.stat()
    if status.st_uid != os.getuid():
        return f"{directory} belongs to another user"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"other users can write to {directory} (chmod go-w prevents that)"
    parents = directory.absolute().parents
    # The owner of the root folder is the administrator.
    trusted = {os.getuid(), parents[-1].stat().st_uid}
    for parent in parents:
        status = parent.stat()
        # With the sticky bit, users cannot replace the entries of other users.
        is_open = status.st_mode & stat.S_IWOTH and not status.st_mode & stat.S_ISVTX
        if status.st_uid not in trusted or is_open:
            return f"other users can write to {parent} and so replace {directory}"
    return None if os.access(directory, os.W_OK) else f"{directory} cannot be written to"


class FileCodeStore(CodeStore):
    """A folder of compiled code of an entry point, with a file for each signature.

    `find_bitcode` returns the bitcode that the package contains for a signature.
    """

    def __init__(
        self, directory: Path, find_bitcode: Callable[[Any], bytes | None] = lambda signature: None
    ) -> None:
        self.cache_path = str(directory)
        self._directory = directory
        self._find_bitcode = find_bitcode

    def read(self, key: str) -> bytes | None:
        """Return the code under a key, or None if the file is missing or the checksum differs."""
        path = self._path(key)
        try:
            raw = path.read_bytes()
        except OSError:
            return None
        if self._digest(key, raw[DIGEST_BYTES:]) != raw[:DIGEST_BYTES]:
            self.discard(key)
            return None
        return raw[DIGEST_BYTES:]

    def write(self, key: str, content: bytes) -> None:
        """Store compiled code, or warn if that is not possible."""
        path = self._path(key)
        try:
            self._directory.mkdir(mode=0o700, exist_ok=True)
            write_atomically(path, self._digest(key, content) + content)
        except OSError as error:
            _warn_not_stored(self._directory.parent, error.errno or errno.EIO)

    def discard(self, key: str) -> None:
        """Remove the code under a key, so that it is compiled again."""
        self._path(key).unlink(missing_ok=True)

    def read_bitcode(self, signature: Any) -> bytes | None:
        """Return the bitcode that the package contains for a signature; None if there is none."""
        return self._find_bitcode(signature)

    def _digest(self, key: str, content: bytes) -> bytes:
        """Return the SHA-256 of code and of the path of its file, which detects exchanged files."""
        return hashlib.sha256(f"{self._directory.name}/{key}\n".encode() + content).digest()

    def _path(self, key: str) -> Path:
        return self._directory / f"{key}{CODE_SUFFIX}"


@contextmanager
def lock_directory(directory: Path | None) -> Iterator[None]:
    """Let one process at a time compile code for a folder. Other processes then load the code."""
    with ExitStack() as stack:
        if directory is not None and fcntl is not None and not _has_code(directory):
            # If the lock fails, each process compiles the code.
            with suppress(OSError):
                directory.mkdir(mode=0o700, exist_ok=True)
                file = stack.enter_context((directory / "lock").open("w"))
                fcntl.flock(file, fcntl.LOCK_EX)
        yield


@cache
def _warn_not_stored(directory: Path, error_number: int) -> None:
    """Warn once per folder that code cannot be stored."""
    message = f"compiled code is not cached: {directory}: {os.strerror(error_number)}"
    warnings.warn(message, RuntimeWarning, stacklevel=3)


def is_cached(functions: Functions) -> bool:
    """Return whether the cache has the compiled code of an entry point."""
    directory = cache_directory(functions)
    return directory is not None and _has_code(directory)


def _has_code(directory: Path) -> bool:
    return any(directory.glob(f"*{CODE_SUFFIX}"))
