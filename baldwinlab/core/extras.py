"""Extras (groups of optional packages): purposes, missing packages and installation."""

from __future__ import annotations

import importlib.metadata
import json
import re
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit
from urllib.request import url2pathname

from baldwinlab.core.errors import RefusedError

# Purpose of each extra for users. Extras for developers are not listed.
EXTRA_PURPOSES: Final = {
    "cuda": "simulation on an NVIDIA GPU",
    "cluster": "studies on a Dask or Slurm cluster, and in remote storage",
    "exchange": "export to formats of third-party libraries",
    "lab": "the lab in the browser",
    "notebook": "the notebooks",
    "rl": "environments of PettingZoo and Gymnasium",
    "s3": "studies in an object store with the interface of S3",
    "video": "movies as .mp4",
    "wasm": "exported pages with custom parts",
}
# Key of the packages that every installation needs.
CORE: Final = ""


def missing_extra_error(extra: str, feature: str) -> RefusedError:
    """Return the error for a feature whose extra is not installed."""
    missing = missing_packages(extra)
    packages = f" (not installed: {', '.join(missing)})" if missing else ""
    return RefusedError(
        f"{feature} needs the extra {extra!r}{packages}: {installation_command(extra)}"
    )


def missing_packages(extra: str) -> list[str]:
    """Return the packages of an extra that are not installed."""
    return [name for name in required_packages().get(extra, []) if installed_version(name) is None]


def required_packages() -> dict[str, list[str]]:
    """Return the required packages by extra, as the installed metadata lists them.

    The key of packages without an extra is `CORE`.
    """
    packages: dict[str, list[str]] = {}
    for requirement in _read_requirements():
        name_match = re.match(r"[A-Za-z0-9._-]+", requirement)
        extra_match = re.search(r"extra == ['\"]([^'\"]+)", requirement)
        if name_match:
            extra = extra_match.group(1) if extra_match else CORE
            packages.setdefault(extra, []).append(name_match.group())
    return packages


def _read_requirements() -> list[str]:
    try:
        return importlib.metadata.requires("baldwinlab") or []
    except importlib.metadata.PackageNotFoundError:
        # The package is imported from its source, without an installation.
        return []


def installed_version(name: str) -> str | None:
    """Return the version of an installed package, or None."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def installation_command(extra: str) -> str:
    """Return the pip command that adds an extra to this installation of baldwinlab.

    An installation from a folder, a file or a repository records the origin (PEP 610), and the
    command contains this origin. An installation from a package index records no origin, and the
    command contains only the name of the package.
    """
    origin = _read_origin()
    url = origin.get("url", "")
    folder = origin.get("dir_info")
    repository = origin.get("vcs_info")
    if folder is None and repository:
        url = f"{repository['vcs']}+{url}@{repository['commit_id']}"
    if folder is None:
        address = f" @ {url}" if url else ""
        return f'pip install "baldwinlab[{extra}]{address}"'
    source_folder = Path(url2pathname(urlsplit(url).path))
    editable_option = "-e " if folder.get("editable") else ""
    if not (source_folder / "pyproject.toml").is_file():
        return (
            f'pip install {editable_option}".[{extra}]" in the folder of the source of baldwinlab'
        )
    return f'pip install {editable_option}"{source_folder}[{extra}]"'


def _read_origin() -> dict[str, Any]:
    """Return the recorded origin of this installation; an empty dict for a package index."""
    try:
        text = importlib.metadata.distribution("baldwinlab").read_text("direct_url.json")
    except importlib.metadata.PackageNotFoundError:
        # The package is imported from its source: this file is SOURCE/baldwinlab/core/extras.py.
        source_folder = Path(__file__).parents[2]
        text = json.dumps({"url": source_folder.as_uri(), "dir_info": {"editable": True}})
    origin: dict[str, Any] = json.loads(text or "{}")
    return origin
