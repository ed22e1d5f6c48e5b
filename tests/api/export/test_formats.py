"""Rules that every export format fulfills: complete files, refusals, and missing libraries."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from weakref import ref

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab import ArgumentError, Study, StudyError
from baldwinlab.api.export import formats, table
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import installation_command
from baldwinlab.studies import records
from baldwinlab.studies import store as stored
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset

FORMATS = formats.study_formats()
OPTIONS: dict[str, dict[str, Any]] = {
    "onnx": {"run": 1, "generation": 0, "agent": 0},
    "tskit": {"run": 1},
}
"""Options without which a format cannot be written for a study with two runs."""
TABLES: list[Callable[[Study], object]] = [
    lambda study: study.to_pandas(),
    lambda study: study.to_arviz(),
]
WITH_LIBRARY = [format.name for format in FORMATS.values() if format.library]


def export(study: Study, name: str, folder: Path) -> None:
    """Export a study into a folder, with the options that the format needs."""
    format = FORMATS[name]
    path = None if format.output == "none" else folder / f"x{format.suffix}"
    study.export(path, format=name, **OPTIONS.get(name, {}))


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Run one condition twice. Tests do not change it."""
    folder = tmp_path_factory.mktemp("formats") / "study"
    return bl.open_study(make_small_study(folder, [shorten_preset("evo/A")], runs=2).directory)


@pytest.fixture
def copy(small: Study, tmp_path: Path) -> Study:
    return bl.open_study(shutil.copytree(small.directory, tmp_path / "copy"))


def test_a_study_without_a_run_and_a_damaged_run_are_named_and_nothing_is_left(
    copy: Study, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    record = copy.directory / "runs" / "evo" / "A" / "0001.nc"
    record.write_bytes(record.read_bytes()[:-1] + b"?")
    for name in FORMATS:
        with pytest.raises(StudyError, match=r"0001\.nc is damaged"):
            export(copy, name, out)
    for read_table in TABLES:
        with pytest.raises(StudyError, match=r"0001\.nc is damaged"):
            read_table(copy)
    record.unlink()
    record.with_name("0000.nc").unlink()
    for name in FORMATS:
        with pytest.raises(StudyError, match="holds no finished run yet"):
            export(copy, name, out)
    for read_table in TABLES:
        with pytest.raises(StudyError, match="holds no finished run yet"):
            read_table(copy)
    assert not list(out.iterdir())
    assert not (copy.directory / "ro-crate-metadata.json").exists()


@pytest.mark.parametrize("name", WITH_LIBRARY)
def test_without_a_library_the_error_has_the_command_that_installs_it(
    copy: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    library = FORMATS[name].library
    for module in [module for module in sys.modules if module.partition(".")[0] == library]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, library, None)
    out = tmp_path / "out"
    out.mkdir()
    with pytest.raises(RefusedError, match=re.escape(installation_command("exchange"))):
        export(copy, name, out)
    assert not list(out.iterdir())
    assert not (copy.directory / "ro-crate-metadata.json").exists()


@pytest.mark.parametrize("name", ["csv", "parquet"])
def test_an_export_has_a_few_runs_in_memory_at_a_time(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = records.read_record_of_file
    references: list[ref[np.ndarray]] = []
    peak_count = 0

    def read_and_count(*arguments: Any) -> xr.Dataset:
        nonlocal peak_count
        record = read(*arguments)
        references.append(ref(record["energy"].values))
        peak_count = max(peak_count, sum(reference() is not None for reference in references))
        return record

    monkeypatch.setattr(records, "read_record_of_file", read_and_count)
    monkeypatch.setattr(stored, "read_record_of_file", read_and_count)
    monkeypatch.setattr(table, "MIN_ROWS", 1)
    study = make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=9)
    export(bl.open_study(study.directory), name, tmp_path)
    assert len(references) >= 9
    assert peak_count <= 3


@pytest.mark.parametrize("name", FORMATS)
def test_the_command_overwrites_its_own_files_and_no_others(
    copy: Study, command: Command, name: str
) -> None:
    format = FORMATS[name]
    path = Path(f"x{format.suffix}")
    output = ["--out", str(path)]
    if format.output == "none":
        path, output = copy.directory / "ro-crate-metadata.json", []
    options = [
        text
        for option, value in OPTIONS.get(name, {}).items()
        for text in (f"--{option}", str(value))
    ]
    words = ("export", str(copy.directory), "--format", name, *output, *options)
    first = command(*words)
    assert first.code == 0, first.err
    if name == "zarr":
        refused = command(*words, "--force")
        assert refused.code == 2 and "exists. Choose another path or remove it." in refused.err
        return
    assert command(*words) == first
    path.write_text("condition,years of work\n")
    refused = command(*words)
    assert refused.code == 2 and "exists and was not written by this command" in refused.err
    assert command(*words, "--force").code == 0


SENTENCES = {
    "--out x.xlsx": "--out x.xlsx must end in .csv for csv, .onnx for onnx, .parquet for parquet, "
    ".trees for tskit, .zarr for zarr or .html for page; or give --format",
    "--out x.csv --seed 3": "--seed applies to --format page, not csv",
    "--out x.csv --part x.py": "--part applies to --format onnx, phylogeny, ro-crate, tskit or "
    "page, not csv",
    "": "--out is missing: give a file that ends in .csv, .onnx, .parquet, .trees, .zarr or .html; "
    "only --format ro-crate or lesson needs no file",
    "--format csv": "--out is missing: --format csv needs the name of a file",
    "--format ro-crate --out x.json": "--out applies to --format csv, onnx, parquet, "
    "phylogeny, tskit, zarr, page, explorable or lesson, not ro-crate",
    "--format csv --out x.txt": "--out x.txt must end in .csv, as --format csv needs",
    "--out no/x.zarr": "--out no/x.zarr: the folder no does not exist. Create it or choose another "
    "path.",
    "--out no/x.csv": "--out no/x.csv: the folder no does not exist. Create it or choose another "
    "path.",
    "--format phylogeny --run 0 --out x.csv": "--run 0 needs --condition, because every condition "
    "has a run 0; add --condition",
    "--format lesson": "STUDY does not apply to --format lesson: its experiments are fixed",
    "--out b.onnx": "--format onnx needs --generation GENERATION and --agent AGENT",
    "--out b.trees": "STUDY has 2 runs of evo/A; choose one with --run",
    "--out b.trees --run -1": "--run -1 must be a whole number from 0 to 2147483647",
    "--format ro-crate --license ask_me": "--license ask_me must be an address, https://..., or an "
    "SPDX name such as CC-BY-4.0",
    "--format ro-crate --author=": "--author needs a value; usage: baldwinlab export [SOURCE]; "
    "baldwinlab export --help lists the options",
}


@pytest.mark.parametrize("line", SENTENCES)
def test_an_option_that_cannot_be_used_is_refused_in_a_sentence(
    small: Study, command: Command, tmp_path: Path, line: str
) -> None:
    outcome = command("export", str(small.directory), *line.split())
    sentence = SENTENCES[line].replace("STUDY", str(small.directory))
    assert (outcome.code, outcome.err) == (2, f"baldwinlab: {sentence}\n")
    assert not list(tmp_path.iterdir())
    assert not (small.directory / "ro-crate-metadata.json").exists()


def test_a_preset_has_no_results_and_a_study_is_needed(command: Command) -> None:
    done = command("export", "evo/A", "--out", "x.csv")
    assert (done.code, done.err) == (2, "baldwinlab: evo/A holds no study: it has no study.toml\n")
    done = command("export", "--out", "x.csv")
    assert done.err == (
        "baldwinlab: SOURCE is missing: --format csv needs the directory of a study\n"
    )


@pytest.mark.parametrize("name", ["run", "generation", "agent"])
@pytest.mark.parametrize("value", [-1, 1.5, True, "2", 2**40])
def test_a_number_of_an_export_is_checked_before_anything_is_written(
    small: Study, tmp_path: Path, name: str, value: Any
) -> None:
    options = {"run": 0, "generation": 0, "agent": 0, name: value}
    with pytest.raises(ArgumentError, match=rf"{name} = .* must be a whole number from 0 to \d+"):
        small.export(tmp_path / "x.onnx", **options)
    assert not list(tmp_path.iterdir())


def test_an_unknown_format_and_an_unknown_option_are_refused(small: Study, tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match="--format excel must be csv, onnx, parquet"):
        small.export(tmp_path / "x.xlsx", format="excel")
    with pytest.raises(RefusedError, match="--color does not apply to --format csv"):
        small.export(tmp_path / "x.csv", color="red")
    assert not list(tmp_path.iterdir())
