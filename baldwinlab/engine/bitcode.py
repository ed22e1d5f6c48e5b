"""The bitcode of entry points that the package contains, for a fast first start.

Bitcode is LLVM code after all of LLVM's passes. It is the same for all processors of an
architecture, and LLVM turns it into machine code in a tenth of the time of a compilation. The
optimization preserves every operation, so results are bit-identical with those of a compilation.

The bitcode is used only with the minor version of Numba, the target and the number of lanes for
which it was made. The name of a file with bitcode contains a hash of the modules that are compiled
into the bitcode, so that changed modules do not match. `scripts/entry_points.py` writes the files.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any, Final

import numba
from llvmlite import binding as llvm

from baldwinlab.core.file_writing import write_atomically
from baldwinlab.engine import simd
from baldwinlab.engine.cache import Functions, hash_sources
from baldwinlab.engine.fingerprint import STORED, list_modules, name_fingerprint, write_sources
from baldwinlab.engine.numba_internals.dispatchers import hash_signature

FOLDER: Final = Path(__file__).parent / "entry_points"
REQUIREMENTS: Final = "requirements.json"
SUFFIX: Final = ".bitcode"


def list_requirements() -> dict[str, Any]:
    """Return the conditions under which another process can use bitcode of this process."""
    return {
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
    return is_usable() and any(FOLDER.glob(f"{_identify(functions)}-*{SUFFIX}"))


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
    return FOLDER / f"{_identify(functions)}-{hash_signature(signature)}{SUFFIX}"


def _identify(functions: Functions) -> str:
    """Return a name of an entry point and of the sources that are compiled into it."""
    return f"{name_fingerprint(functions)}-{hash_sources(functions)}"


def write_bitcode(entry_points: Iterable[tuple[Functions, Any, bytes]]) -> None:
    """Replace the bitcode in the package. `entry_points` has (functions, signature, bitcode)."""
    FOLDER.mkdir(exist_ok=True)
    contents: dict[Path, bytes] = {}
    modules: set[str] = set()
    for functions, signature, bitcode in entry_points:
        path = bitcode_path(functions, signature)
        if path in contents:
            raise ValueError(f"two entry points have the name {path.name}")
        contents[path] = zlib.compress(bitcode, level=9)
        modules |= list_modules(functions)
    for path in {*FOLDER.glob(f"*{SUFFIX}")} - {*contents}:
        path.unlink()
    for path, content in contents.items():
        write_atomically(path, content)
    requirements = json.dumps(list_requirements(), indent=2)
    write_sources(FOLDER / STORED.name, modules)
    write_atomically(FOLDER / REQUIREMENTS, f"{requirements}\n".encode())
