"""Check docstrings with numpydoc: `python -m scripts.docstrings [PACKAGE ...]`.

The script checks the given packages or, by default, those of `PACKAGES` and every name of
`baldwinlab.__all__`.
The checks are in `[tool.numpydoc_validation]` of pyproject.toml.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from numpydoc.hooks.validate_docstrings import parse_config, process_file

import baldwinlab

ROOT = Path(__file__).parents[1]
PACKAGES = ("api", "parts", "analysis/statistics")


def source_files(packages: Sequence[str]) -> list[Path]:
    """Return the modules of packages."""
    folders = [ROOT / "baldwinlab" / package for package in packages]
    return [path for folder in folders for path in sorted(folder.rglob("*.py"))]


def public_objects() -> Iterator[tuple[Path, str]]:
    """Yield the source file and the name of each public function and class."""
    for name in baldwinlab.__all__:
        value = getattr(baldwinlab, name)
        if inspect.isfunction(value) or inspect.isclass(value):
            yield Path(inspect.getfile(value)), value.__qualname__


def main(packages: Sequence[str]) -> int:
    """Print the errors of all docstrings, and return 1 if there are any."""
    config = parse_config(ROOT)
    files = source_files(packages or PACKAGES)
    errors = [error for path in files for error in process_file(path, config)]
    objects = [] if packages else list(public_objects())
    for path, name in objects:
        prefix = f"{path.stem}.{name}"
        errors += [
            error
            for error in process_file(path, config)
            if f"{error[1]}.".startswith(f"{prefix}.") and error not in errors
        ]
    for location, name, check, description in errors:
        print(f"{Path(location).relative_to(ROOT)}: {name}: {check} {description}")
    return bool(errors)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
