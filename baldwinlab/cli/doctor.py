"""The command `doctor`: examine this machine, and suggest a fix for each problem."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Final, Literal, NamedTuple

from cyclopts import Parameter

from baldwinlab._version import __version__
from baldwinlab.cli.options import Json
from baldwinlab.core import console, extras, resources
from baldwinlab.core.files import find_paths
from baldwinlab.engine import cache
from baldwinlab.engine.threads import available_cores

State = Literal["well", "missing", "problem"]
"""The state of a topic. An absent optional feature is "missing", and not a "problem"."""
MIN_FREE_BYTES: Final = 2**30
"""Memory, and disk space, that a study of the first paper needs."""
STATE_MARKS: Final = {"well": "ok", "missing": "-", "problem": "PROBLEM"}


class DoctorFinding(NamedTuple):
    """The result of one check."""

    topic: str  # The subject of the check, such as "memory".
    state: State  # "well", "missing" or "problem".
    message: str
    fix: str = ""  # How to fix the problem; "" if the state is "well".


def doctor(
    folder: Annotated[
        Path, Parameter(help="Folder for studies. The command tests whether it can be written.")
    ] = Path("results"),
    /,
    *,
    json: Json = False,
) -> None:
    """List installed packages, extras, cores, memory, disk, cache and GPU, and how to fix problems.

    A line that begins with "-" names a missing optional feature. A line that begins with "PROBLEM"
    names a missing requirement of baldwinlab. The exit status is 1 if there is a problem.

    For example:

        baldwinlab doctor
    """
    findings = []
    console.reserve_stdout(json)
    for finding in examine(folder):
        findings.append(finding)
        fix = f"; {finding.fix}" if finding.fix else ""
        console.info(f"{STATE_MARKS[finding.state]:<8} {finding.topic:<16} {finding.message}{fix}")
    if json:
        console.print_json([finding._asdict() for finding in findings])
    if has_problem(findings):
        console.warn("this machine has problems, see the lines that begin with PROBLEM")
        sys.exit(1)


def examine(folder: Path) -> Iterator[DoctorFinding]:
    """Yield the findings on this machine. `folder`: for studies; it may not exist yet."""
    system = f"{platform.system()} {platform.machine()}"
    message = f"{platform.python_version()} on {system}, baldwinlab {__version__}"
    yield DoctorFinding("Python", "well", message)
    yield from _check_packages()
    yield _check_cores()
    yield _check_free_space(
        "memory",
        resources.available_memory(),
        "close other programs, or simulate fewer agents or worlds at a time",
    )
    yield _check_cache()
    yield _check_writing(folder)
    yield _check_free_space(
        f"disk, {folder}", resources.free_disk(folder), "write studies to another disk with --out"
    )
    yield _check_gpu()


def _check_packages() -> Iterator[DoctorFinding]:
    """Yield a finding for the core and each extra: versions, or missing packages and the fix."""
    required = extras.required_packages()
    for extra in (extras.CORE, *extras.EXTRA_PURPOSES):
        versions = {name: extras.installed_version(name) for name in required.get(extra, [])}
        installed = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
        missing = ", ".join(name for name, version in versions.items() if version is None)
        if extra == extras.CORE and missing:
            fix = "install baldwinlab again with pip"
            yield DoctorFinding("core", "problem", f"not installed: {missing}", fix)
        elif extra == extras.CORE:
            yield DoctorFinding("core", "well", installed)
        else:
            yield _check_extra(extra, installed, missing)


def _check_extra(extra: str, installed: str, missing: str) -> DoctorFinding:
    topic = f"extra {extra}"
    purpose = f"for {extras.EXTRA_PURPOSES[extra]}"
    if missing:
        message = f"{purpose}; not installed: {missing}"
        return DoctorFinding(topic, "missing", message, extras.installation_command(extra))
    return DoctorFinding(topic, "well", f"{purpose}: {installed}")


def _check_cores() -> DoctorFinding:
    n_usable = available_cores()
    n_cores = os.cpu_count() or 1
    count_text = f"{n_usable} of {n_cores}" if n_usable != n_cores else str(n_usable)
    return DoctorFinding(
        "cores", "well", f"{count_text}, the default number of threads (--workers)"
    )


def _check_free_space(topic: str, free_bytes: int | None, fix: str) -> DoctorFinding:
    if free_bytes is None:
        return DoctorFinding(
            topic,
            "missing",
            "the system does not report the free space",
            "commands start without a check of the free space",
        )
    message = f"{resources.format_bytes(free_bytes)} free"
    if free_bytes >= MIN_FREE_BYTES:
        return DoctorFinding(topic, "well", message)
    return DoctorFinding(topic, "problem", message, fix)


def _check_cache() -> DoctorFinding:
    """Check the folder of compiled code. `cache_root` warns if no folder can be used."""
    with warnings.catch_warnings(record=True) as folder_warnings:
        warnings.simplefilter("always")
        folder = cache.cache_root()
    if folder is None:
        return DoctorFinding(
            "compiled code",
            "problem",
            "; ".join(str(warning.message) for warning in folder_warnings),
            "set BALDWINLAB_CACHE to a folder that only you can write to",
        )
    cache_bytes = sum(
        file.stat().st_size for file in find_paths(folder, f"**/*{cache.CODE_SUFFIX}")
    )
    return DoctorFinding(
        "compiled code", "well", f"{resources.format_bytes(cache_bytes)} in {folder}"
    )


def _check_writing(folder: Path) -> DoctorFinding:
    """Write a temporary file into the folder, or into the nearest parent folder that exists."""
    parents = (folder, *folder.absolute().parents)
    existing_folder = next(parent for parent in parents if parent.exists())
    try:
        with tempfile.TemporaryFile(dir=existing_folder) as file:
            file.write(b"baldwinlab")
    except OSError as error:
        message = f"{existing_folder} cannot be written to ({error.strerror})"
        fix = "change to a folder that you can write to, or pass one with --out"
        return DoctorFinding("studies", "problem", message, fix)
    return DoctorFinding("studies", "well", f"{folder} can be written to")


def _check_gpu() -> DoctorFinding:
    if extras.installed_version("numba-cuda") is None:
        return DoctorFinding(
            "GPU",
            "missing",
            "not checked, because the extra cuda is not installed; the CPU gives the same results",
        )
    # Imported late: the CUDA backend takes a while to load.
    from baldwinlab.models.miniworld.backends import cuda

    problem = cuda.unavailable_reason()
    if problem:
        return DoctorFinding("GPU", "missing", problem)
    return DoctorFinding("GPU", "well", "an NVIDIA GPU that can be used")


def has_problem(findings: Sequence[DoctorFinding]) -> bool:
    """Return whether one of the findings is a problem."""
    return any(finding.state == "problem" for finding in findings)
