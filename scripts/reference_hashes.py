"""Hash short reproductions of all papers, and compare the hashes with those of another version.

    python -m scripts.reference_hashes FOLDER              reproduce, and write FOLDER/hashes.json
    python -m scripts.reference_hashes FOLDER --against F  also print what differs from F

A study in FOLDER is resumed. The hash of a record does not depend on how runs are grouped in files.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import baldwinlab as bl
from baldwinlab import papers

SHORT_RUN = ("--runs", "2", "--generations", "3", "--force")
# Only foragers of MiniWorld have steps.
SHORT_LIFETIME = ("--steps", "60")
OTHER_FILES = ("*.csv", "claims.json", "baldwin.json", "results.json", "gallery.json")
PACKAGE = Path(str(bl.__file__)).parent


def reproduce(name: str, out: Path) -> str:
    """Reproduce a paper in short form. Return the errors, "" without an error."""
    errors = []
    for options in ((*SHORT_RUN, *SHORT_LIFETIME), SHORT_RUN):
        command = (sys.executable, "-m", "baldwinlab", "reproduce", name, *options, "--out", out)
        result = subprocess.run(command, capture_output=True, text=True, encoding="utf-8")
        if result.returncode == 0:
            return ""
        errors.append(result.stderr.strip())
    return "; ".join(errors)


def hash_values(values: Any) -> str:
    """Hash the type, shape and bytes of an array."""
    array = np.asarray(values)
    content = str(array.tolist()).encode() if array.dtype.kind in "OU" else array.tobytes()
    return sha256(f"{array.dtype.kind}{array.shape}".encode() + content).hexdigest()[:16]


def hash_dataset(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the name and the hash of each variable of a file, for each run."""
    with xr.open_dataset(path, decode_times=False) as dataset:
        for name, variable in dataset.variables.items():
            if "run" in variable.dims and "run" in dataset.coords:
                for run in dataset["run"].values:
                    yield f"{name}[{run}]", hash_values(dataset[name].sel(run=run).values)
            else:
                yield f"{name}[{dataset.attrs.get('run', '')}]", hash_values(variable.values)


def hash_study(folder: Path) -> dict[str, str]:
    """Return the hashes of the values of records and assays, and of the files of results."""
    hashes = {}
    for path in sorted(folder.rglob("*.nc")):
        # Runs can be grouped in files in several ways, so the folder names a record.
        place = path.parent if "runs" in path.parts else path
        for name, value in hash_dataset(path):
            hashes[f"{place.relative_to(folder)}:{name}"] = value
    for pattern in OTHER_FILES:
        for path in sorted(folder.rglob(pattern)):
            hashes[str(path.relative_to(folder))] = sha256(path.read_bytes()).hexdigest()[:16]
    return hashes


def hash_modules() -> dict[str, str]:
    """Return the hashes of the WebAssembly modules of exported pages."""
    return {
        str(path.relative_to(PACKAGE)): sha256(path.read_bytes()).hexdigest()[:16]
        for path in sorted(PACKAGE.rglob("*.wasm*"))
    }


def list_differences(before: dict[str, Any], after: dict[str, Any]) -> Iterator[str]:
    """Yield a line for each group, and for each hash that differs."""
    for group in sorted(before | after):
        old, new = before.get(group, {}), after.get(group, {})
        names = [name for name in sorted(old | new) if old.get(name) != new.get(name)]
        yield f"{group}: {len(old | new)} compared, {len(names)} differ"
        yield from (f"  {name}: {old.get(name)} -> {new.get(name)}" for name in names)


def main() -> None:
    """Reproduce all papers, and write and compare the hashes."""
    parser = argparse.ArgumentParser(description="Hash short reproductions of all papers.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--against", type=Path)
    parser.add_argument("--papers", nargs="*", default=list(papers.built_in()))
    arguments = parser.parse_args()
    hashes = {"modules": hash_modules()}
    for name in arguments.papers:
        error = reproduce(name, arguments.folder / name)
        hashes[name] = {"error": error} if error else hash_study(arguments.folder / name)
        print(f"{name}: {len(hashes[name])} hashes {error}", flush=True)
    text = json.dumps(hashes, indent=1, sort_keys=True)
    (arguments.folder / "hashes.json").write_text(f"{text}\n", encoding="utf-8")
    if arguments.against:
        print("\n".join(list_differences(json.loads(arguments.against.read_text("utf-8")), hashes)))


if __name__ == "__main__":
    main()
