"""What this machine has for baldwinlab, and what it lacks: each problem with its mend."""

from __future__ import annotations

import os
import platform
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Literal, NamedTuple

from baldwinlab._version import __version__
from baldwinlab.core import extras, resources
from baldwinlab.engine import cache
from baldwinlab.simulation.compilation import available_cores

State = Literal["well", "missing", "problem"]  # missing is what may be
LITTLE: Final = 2**30  # bytes of memory or disk: less than a study of the paper takes


class Finding(NamedTuple):
    about: str
    state: State
    said: str
    mend: str = ""


def examine(folder: Path) -> Iterator[Finding]:
    """What is found of this machine; `folder` is where studies would be written."""
    yield _python()
    yield from _packages()
    yield _cores()
    yield _room(
        "memory",
        resources.available_memory(),
        "close other programs, or run fewer agents or worlds at a time",
    )
    yield _cache()
    yield _written(folder)
    yield _room(
        f"disk, {folder}", resources.free_disk(folder), "write studies elsewhere with --out"
    )
    yield _gpu()


def _python() -> Finding:
    said = f"{platform.python_version()} on {platform.system()} {platform.machine()}, baldwinlab {__version__}"
    return Finding("Python", "well", said)


def _packages() -> Iterator[Finding]:
    """Describe the core and each extra: installed versions, or the missing packages and how to install them."""
    for extra in (extras.CORE, *extras.PURPOSES):
        versions = {
            name: extras.installed_version(name)
            for name in extras.required_packages().get(extra, [])
        }
        installed = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
        missing = ", ".join(name for name, version in versions.items() if version is None)
        about, purpose = f"extra {extra}", f"for {extras.PURPOSES.get(extra)}"
        if extra == extras.CORE:
            mend = "install baldwinlab again, with pip" if missing else ""
            said = f"not installed: {missing}" if missing else installed
            yield Finding("core", "problem" if missing else "well", said, mend)
        elif missing:
            said = f"{purpose}; not installed: {missing}"
            yield Finding(about, "missing", said, extras.installation_command(extra))
        else:
            yield Finding(about, "well", f"{purpose}: {installed}")


def _cores() -> Finding:
    usable, all_there = available_cores(), os.cpu_count() or 1
    said = f"{usable} of {all_there}" if usable != all_there else str(usable)
    return Finding("cores", "well", f"{said}: so many threads live unless --workers says otherwise")


def _room(about: str, left: int | None, mend: str) -> Finding:
    if left is None:
        return Finding(
            about,
            "missing",
            "this system does not tell how much is free",
            "nothing is refused for want of it",
        )
    return Finding(
        about,
        "well" if left >= LITTLE else "problem",
        f"{resources.amount(left)} free",
        "" if left >= LITTLE else mend,
    )


def _cache() -> Finding:
    """Where compiled code is kept."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        place = cache.place()
    if place is None:
        why = "; ".join(str(each.message) for each in caught)
        return Finding(
            "compiled code",
            "problem",
            why,
            "let BALDWINLAB_CACHE name a folder that only you may write to",
        )
    held = sum(file.stat().st_size for file in place.rglob(f"*{cache.ENDING}"))
    return Finding("compiled code", "well", f"{resources.amount(held)} in {place}")


def _written(folder: Path) -> Finding:
    """Whether a study can be written, by writing a file as one would be."""
    there = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    try:
        with tempfile.TemporaryFile(dir=there) as file:
            file.write(b"baldwinlab")
    except OSError as error:
        said = f"{there} cannot be written to ({error.strerror})"
        return Finding("studies", "problem", said, "go to a folder of your own, or give --out one")
    return Finding("studies", "well", f"{folder} can be written to")


def _gpu() -> Finding:
    if extras.installed_version("numba-cuda") is None:
        return Finding(
            "GPU",
            "missing",
            "not looked for, as the extra cuda is not installed; the CPU gives the same bits",
        )
    from baldwinlab.models.miniworld.backends import cuda  # here, because to load it takes a while

    problem = cuda.available()
    return Finding(
        "GPU", "missing" if problem else "well", problem or "an NVIDIA GPU that can be used"
    )


def is_well(findings: list[Finding]) -> bool:
    return not any(finding.state == "problem" for finding in findings)
