"""A study as Zarr, as a phylogeny and for ArviZ, against the libraries that are to read them."""

from __future__ import annotations

import warnings
from pathlib import Path
from weakref import ref

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import zarr

import baldwinlab as bl
from baldwinlab import Study
from baldwinlab.analysis.statistics import fitness
from baldwinlab.api.export import files
from baldwinlab.api.export import zarr as zarr_export
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.studies import store as stored
from tests.api.export.validators import validate
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset


def test_a_zarr_store_opens_as_the_study_with_units_and_labels(
    mixed: Study, tmp_path: Path
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # as of types that Zarr's specification does not have
        mixed.to_zarr(tmp_path / "study.zarr")
    data = bl.open_runs(mixed.directory)
    opened = xr.open_zarr(tmp_path / "study.zarr", consolidated=False).load()
    xr.testing.assert_equal(opened, data)
    for name in data.variables:
        assert {key: opened[name].attrs[key] for key in data[name].attrs} == data[name].attrs
    assert opened.food_eaten.attrs == {"units": "items", "long_name": "items eaten in life"}
    assert bl.read_experiment(opened, "guessing") == mixed.experiment("guessing")
    assert zarr.open_group(tmp_path / "study.zarr", mode="r").metadata.zarr_format == 3


@pytest.mark.parametrize("rows", [1, 150, 250])
def test_a_store_of_many_chunks_is_the_dataset_of_the_sweep(
    tmp_path: Path, rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run has 40 rows: a chunk holds one run, three of them, or two points of three runs each, of which one is left over."""
    monkeypatch.setattr(zarr_export, "ROWS", rows)
    short = {"lifetime.steps": 20, "evolution.generations": 2}
    fields = {"evolution.selection": ["roulette", "truncation"], "learning.rate": [0.5, 0.0, 0.1]}
    study = bl.sweep(
        {"experiment": "evo+self-taught/A", "runs": 3, "set": short, "fields": fields},
        out=tmp_path / "swept",
    )
    for name in ("whole", "gaps"):  # among which whole numbers are fractions, as NaN is one
        study.to_zarr(tmp_path / f"{name}.zarr")
        opened, data = (
            xr.open_zarr(tmp_path / f"{name}.zarr", consolidated=False).load(),
            study.data(),
        )
        xr.testing.assert_equal(opened, data)
        for variable in ("food_eaten", "energy", "parents"):
            assert (opened[variable].dims, opened[variable].dtype) == (
                data[variable].dims,
                data[variable].dtype,
            )
        assert (opened.attrs["design"], opened.attrs["fields"]) == ("grid", [*fields])
        (study.directory / "runs" / study.conditions[4] / "0001.nc").unlink(missing_ok=True)


@pytest.mark.parametrize("way", ["to_zarr", "to_parquet", "to_csv"])
def test_whoever_gives_a_study_away_holds_a_few_of_its_runs_at_a_time(
    tmp_path: Path, way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, held, most = stored.StudyStore.read, list[ref[np.ndarray]](), 0

    def noting(
        self: stored.StudyStore, condition: str, run: int, *, genomes: bool = True
    ) -> xr.Dataset:
        nonlocal most
        record = read(self, condition, run, genomes=genomes)
        held.append(ref(record["energy"].values))
        most = max(most, sum(each() is not None for each in held))
        return record

    monkeypatch.setattr(stored.StudyStore, "read", noting)
    monkeypatch.setattr(zarr_export, "ROWS", 1)
    monkeypatch.setattr(files, "MIN_ROWS", 1)
    study = bl.open_study(
        make_small_study(tmp_path / "study", [shorten_preset("evo/A")], runs=9).directory
    )
    getattr(study, way)(tmp_path / "given")
    assert len(held) >= 9 and most <= 3, "all of them, if all were read before the first is written"


def test_a_store_that_cannot_be_finished_leaves_nothing(
    mixed: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="no space is left in"):
        mixed.to_zarr(tmp_path / "study.zarr")
    assert not list(tmp_path.iterdir())


def test_a_store_in_the_midst_of_a_study_is_refused(mixed: Study) -> None:
    with pytest.raises(RefusedError, match="is inside the study"):
        mixed.to_zarr(mixed.directory / "runs" / "study.zarr")


def test_the_phylogeny_of_a_study_is_that_of_all_its_runs(mixed: Study, command: Command) -> None:
    assert (
        command("phylogeny", str(mixed.directory), "--out", "all.csv").out
        == "all.csv: 152 agents\n"
    )
    found = pd.read_csv("all.csv")
    assert (found["ancestor_list"] == "[none]").sum() == 20 + 20 + 8
    begun = 0
    for (condition, run), there in found.groupby(["condition", "run"], sort=False):
        mixed.to_phylogeny("one.csv", str(condition), int(str(run)))
        one = pd.read_csv("one.csv")
        assert (there["id"].to_numpy() - begun).tolist() == one["id"].tolist()
        parents = (
            there["ancestor_list"]
            .str.findall(r"\d+")
            .map(lambda ids, first=begun: [int(each) - first for each in ids])
        )
        assert (
            parents.tolist()
            == one["ancestor_list"].str.findall(r"\d+").map(lambda ids: [*map(int, ids)]).tolist()
        )
        begun += len(one)
    mixed.to_phylogeny("all.csv", "evo/A")
    assert pd.read_csv("all.csv")["run"].unique().tolist() == [0, 1]


@pytest.mark.nightly
def test_the_phylogeny_of_a_study_fits_the_alife_standard(mixed: Study, tmp_path: Path) -> None:
    path = tmp_path / "all.csv"
    mixed.to_phylogeny(path)
    found = validate("phylogeny", path)
    assert found["is_valid"] and found["is_sexual"] and len(found["roots"]) == 20 + 20 + 8


def test_a_run_of_no_condition_has_no_phylogeny(mixed: Study, command: Command) -> None:
    phylogeny = ("--format", "phylogeny", "--run", "0", "--out", "x.csv")
    done = command("export", str(mixed.directory), *phylogeny)
    assert (done.code, done.err) == (
        2,
        "baldwinlab: --run 0 needs --condition, because every condition has a run 0; add --condition\n",
    )


def test_arviz_has_the_outcome_of_each_run_as_what_was_observed(mixed: Study) -> None:
    convert_to_datatree = pytest.importorskip("arviz_base").convert_to_datatree
    summary = pytest.importorskip("arviz_stats.summary").summary
    tree = mixed.to_arviz(last=2)
    assert convert_to_datatree(tree) is tree
    observed = tree["observed_data"].to_dataset()
    for measure in ("best", "mean", "share"):
        np.testing.assert_array_equal(observed[measure], fitness.final(mixed.data(), measure, 2))
    assert (
        observed["share"].attrs["units"] == "1"
        and observed["mean"].attrs["long_name"] == "fitness of the average agent"
    )

    evo = mixed.to_arviz().observed_data.to_dataset().sel(condition=["evo/A"])
    energy = np.stack([mixed._store.read("evo/A", run)["energy"].values for run in range(2)])
    table = summary(
        xr.DataTree.from_dict({"observed_data": evo}),
        group="observed_data",
        sample_dims=["run"],
        kind="stats",
    )
    assert float(table.loc["mean[evo/A]", "mean"]) == pytest.approx(
        energy.mean(), rel=0.01
    )  # it rounds
    assert float(table.loc["best[evo/A]", "mean"]) == pytest.approx(energy.max(-1).mean(), rel=0.01)


def test_no_generation_at_all_is_refused(mixed: Study) -> None:
    with pytest.raises(ArgumentError):
        mixed.to_arviz(last=0)
