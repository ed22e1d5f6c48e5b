"""Test that bitcode of the package replaces a compilation, and is never stale or damaged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from baldwinlab.engine import bitcode, fingerprint
from tests.engine.processes import run_python

SETUP = """
import sys
from pathlib import Path
from baldwinlab.engine import bitcode, jit, rng
bitcode.FOLDER = Path(sys.argv[1])
print(rng.words(1, 2, 3, 4, (1, 5)).ravel().tolist())
"""
WRITE = f"{SETUP}bitcode.write_bitcode(jit.list_entry_points())\n"
# The types of all of Numba are imported only by a compilation.
READ = f"{SETUP}print('compiled' if 'numba.np.arraymath' in sys.modules else 'loaded')\n"

nightly = pytest.mark.nightly


def print_lines(code: str, *arguments: str, **environment: str) -> list[str]:
    return run_python(code, *arguments, environment=environment).stdout.splitlines()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the bitcode of a function; `words.txt` contains its results."""
    folder = tmp_path_factory.mktemp("bitcode")
    cache = str(tmp_path_factory.mktemp("cache"))
    (words,) = print_lines(WRITE, str(folder), BALDWINLAB_CACHE=cache)
    (folder / "words.txt").write_text(words)
    return folder


def read_words(folder: Path, cache: Path, **environment: str) -> str:
    """Return whether another process loads or compiles the function, whose results are equal."""
    words, origin = print_lines(READ, str(folder), BALDWINLAB_CACHE=str(cache), **environment)
    assert words == (folder / "words.txt").read_text()
    return origin


def copy_folder(folder: Path, target: Path) -> Path:
    target.mkdir()
    for path in folder.iterdir():
        (target / path.name).write_bytes(path.read_bytes())
    return target


def test_bitcode_replaces_a_compilation_with_equal_results(folder: Path, tmp_path: Path) -> None:
    assert read_words(folder, tmp_path / "cache") == "loaded"
    assert len(list((tmp_path / "cache").rglob("*.compiled"))) == 1


@pytest.mark.skipif(not bitcode.list_requirements()["target"].startswith("x86_64"), reason="x86")
def test_bitcode_runs_on_a_processor_without_wide_vectors(folder: Path, tmp_path: Path) -> None:
    processor = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}
    assert read_words(folder, tmp_path / "cache", **processor) == "loaded"


@pytest.mark.parametrize(
    "name",
    ["numba", *(pytest.param(name, marks=nightly) for name in ("target", "lanes"))],
)
def test_bitcode_with_other_requirements_is_not_used(
    name: str, folder: Path, tmp_path: Path
) -> None:
    changed_folder = copy_folder(folder, tmp_path / "bitcode")
    path = changed_folder / bitcode.REQUIREMENTS
    requirements = json.loads(path.read_text())
    path.write_text(json.dumps(requirements | {name: "other"}))
    assert read_words(changed_folder, tmp_path / "cache") == "compiled"


@pytest.mark.parametrize(
    "damage",
    [
        *("cut short", "missing"),
        *(pytest.param(damage, marks=nightly) for damage in ("emptied", "another content")),
    ],
)
def test_damaged_bitcode_is_not_used(damage: str, folder: Path, tmp_path: Path) -> None:
    changed_folder = copy_folder(folder, tmp_path / "bitcode")
    (path,) = changed_folder.glob(f"*{bitcode.SUFFIX}")
    content = path.read_bytes()
    if damage == "missing":
        path.unlink()
    else:
        damaged = {"cut short": content[:-50], "emptied": b"", "another content": b"text"}
        path.write_bytes(damaged[damage])
    assert read_words(changed_folder, tmp_path / "cache") == "compiled"


def test_bitcode_of_other_sources_is_not_used(folder: Path, tmp_path: Path) -> None:
    changed_folder = copy_folder(folder, tmp_path / "bitcode")
    (path,) = changed_folder.glob(f"*{bitcode.SUFFIX}")
    functions, sources, signature = path.stem.split("-")
    path.rename(path.with_stem(f"{functions}-{sources[::-1]}-{signature}"))
    assert read_words(changed_folder, tmp_path / "cache") == "compiled"


def test_the_packaged_bitcode_is_current() -> None:
    stored = json.loads(fingerprint.STORED.read_text())
    changed = {
        name
        for name, code, _ in stored.values()
        if (path := fingerprint.find_module(name)) is None
        or fingerprint.parse_source(name, path.read_bytes()).code != code
    }
    assert not changed, "run `make bitcode`: these modules of compiled code have changed"


def test_the_packaged_bitcode_is_small() -> None:
    assert sum(path.stat().st_size for path in bitcode.FOLDER.iterdir()) < 600_000


SIMULATE = """
import hashlib, sys
import baldwinlab as bl
from baldwinlab.engine import bitcode
if sys.argv[2] == "compiled":
    bitcode.FOLDER = bitcode.FOLDER / "none"
settings = {"evolution": {"generations": 3}, "lifetime": {"steps": 500}}
run = bl.simulate(bl.load(sys.argv[1]).replace(**settings), seed=4)
arrays = [run[name].values.tobytes() for name in ("energy", "parents", "genome")]
print(*(hashlib.sha256(array).hexdigest() for array in arrays))
print("compiled" if "numba.np.arraymath" in sys.modules else "loaded")
"""


needs_packaged_code = pytest.mark.skipif(
    not bitcode.is_usable(), reason="the packaged bitcode is for other code"
)


@needs_packaged_code
def test_a_first_run_of_the_paper_compiles_nothing(tmp_path: Path) -> None:
    _, origin = print_lines(SIMULATE, "evo+self-taught/A", "loaded", BALDWINLAB_CACHE=str(tmp_path))
    assert origin == "loaded"


@needs_packaged_code
@pytest.mark.nightly
@pytest.mark.parametrize("preset", ["evo+self-taught/A", "evo/B"])
def test_packaged_bitcode_has_the_results_of_compiled_code(preset: str, tmp_path: Path) -> None:
    loaded, _ = print_lines(SIMULATE, preset, "loaded", BALDWINLAB_CACHE=str(tmp_path / "loaded"))
    compiled, origin = print_lines(
        SIMULATE, preset, "compiled", BALDWINLAB_CACHE=str(tmp_path / "compiled")
    )
    assert origin == "compiled"
    assert loaded == compiled
