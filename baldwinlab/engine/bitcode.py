"""The bitcode of entry points that the package contains, for a fast first start.

Bitcode is LLVM code after all of LLVM's passes. It is the same for all processors of an
architecture, and LLVM turns it into machine code in a tenth of the time of a compilation. The
optimization preserves every operation, so results are bit-identical with those of a compilation.

The bitcode is used only with the sources, the minor version of Numba, the target and the lanes for
which it was made. `scripts/entry_points.py` writes it.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, Final

import numba
from llvmlite import binding as llvm

from baldwinlab.core.file_writing import write_atomically
from baldwinlab.engine import simd
from baldwinlab.engine.fingerprint import position_fingerprint
from baldwinlab.engine.numba_internals.dispatchers import hash_signature

FOLDER: Final = Path(__file__).parent / "entry_points"
REQUIREMENTS: Final = "requirements.json"
SUFFIX: Final = ".bitcode"

Functions = tuple[Callable[..., Any], ...]


@cache
def hash_files() -> str:
    """Hash the source files of compiled code."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[1]
    for name in ("engine", "evolution", "models", "parts"):
        for source in sorted((package / name).rglob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def list_requirements() -> dict[str, Any]:
    """Return the conditions on which bitcode of this process can be used by another process."""
    return {
        "sources": hash_files(),
        "numba": ".".join(numba.__version__.split(".")[:2]),
        "target": llvm.get_process_triple(),
        "lanes": simd.WIDTH,
    }


@cache
def is_usable() -> bool:
    """Return whether this process meets the requirements of the bitcode in the package."""
    try:
        text = (FOLDER / REQUIREMENTS).read_text("utf-8")
        return bool(json.loads(text) == list_requirements())
    except (OSError, ValueError):
        return False


def is_available(functions: Functions) -> bool:
    """Return whether the package contains usable bitcode of an entry point and its hooks."""
    return is_usable() and any(FOLDER.glob(f"{position_fingerprint(functions)}-*{SUFFIX}"))


def read_bitcode(functions: Functions, signature: Any) -> bytes | None:
    """Return the bitcode of an entry point and its hooks; None if the package contains none."""
    if not is_usable():
        return None
    try:
        return zlib.decompress(bitcode_path(functions, signature).read_bytes())
    except (OSError, zlib.error):
        return None


def bitcode_path(functions: Functions, signature: Any) -> Path:
    """Return the path of the bitcode of an entry point and its hooks."""
    name = f"{position_fingerprint(functions)}-{hash_signature(signature)}"
    return FOLDER / f"{name}{SUFFIX}"


def write_bitcode(entry_points: Iterable[tuple[Functions, Any, bytes]]) -> None:
    """Replace the bitcode of the package by that of functions, for each of their signatures."""
    FOLDER.mkdir(exist_ok=True)
    contents = {
        bitcode_path(functions, signature): zlib.compress(bitcode, level=9)
        for functions, signature, bitcode in entry_points
    }
    for path in {*FOLDER.glob(f"*{SUFFIX}")} - {*contents}:
        path.unlink()
    for path, content in contents.items():
        write_atomically(path, content)
    requirements = json.dumps(list_requirements(), indent=2)
    write_atomically(FOLDER / REQUIREMENTS, f"{requirements}\n".encode())
