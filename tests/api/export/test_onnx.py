"""Networks of agents as ONNX, evaluated with ONNX Runtime."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.api.export.onnx import Moment
from baldwinlab.core.errors import BaldwinLabError
from tests.commands import Command
from tests.small_studies import shorten_preset
from tests.worlds import make_small_experiment

pytest.importorskip("onnx", reason="onnx is not installed; it is in the extra exchange")
runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

CONDITION = "evo+self-taught/A"
MOMENTS: list[tuple[Moment, str]] = [("birth", "weight_birth"), ("death", "weight_death")]
INPUTS = np.random.default_rng(0).uniform(size=(50, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> bl.Study:
    experiment = shorten_preset(CONDITION)
    return bl.run(experiment, runs=2, seed=5, out=tmp_path_factory.mktemp("source") / "study")


def evaluate(path: Path, inputs: npt.NDArray[np.float32]) -> Any:
    return runtime.InferenceSession(path.read_bytes()).run(["outputs"], {"inputs": inputs})[0]


def test_biases_and_several_layers_are_exported(tmp_path: Path) -> None:
    network = {"biases": True, "hidden": [4, 5]}
    experiment = shorten_preset("evo/A").replace(
        network=network, lifetime={"steps": 20}, evolution={"generations": 2}
    )
    study = bl.run(experiment, runs=1, out=tmp_path / "study")
    study.export(tmp_path / "a.onnx", run=0, generation=1, agent=3)
    expected = study.network(0, 1, 3)(INPUTS).values
    np.testing.assert_allclose(evaluate(tmp_path / "a.onnx", INPUTS), expected, atol=1e-6)


def test_the_network_of_an_experiment_with_genes_of_parts_is_exported(tmp_path: Path) -> None:
    experiment = make_small_experiment(
        "evo+self-taught", evolution={"variation": "self-adaptive"}, network={"biases": True}
    )
    study = bl.run(experiment, runs=1, out=tmp_path / "study")
    trace = study.replay(run=0, generation=2)
    # The gene follows the weights of the action module.
    assert experiment.genome_length == experiment.weight_count + 1
    for moment, name in MOMENTS:
        path = tmp_path / f"{moment}.onnx"
        study.export(path, run=0, generation=2, agent=4, at=moment)
        weights = trace[name].values[4, 0]
        hidden = 1 / (1 + np.exp(-INPUTS @ weights[:12].reshape(3, 4) - weights[12:16]))
        outputs = 1 / (1 + np.exp(-hidden @ weights[16:28].reshape(4, 3) - weights[28:31]))
        np.testing.assert_allclose(evaluate(path, INPUTS), outputs, atol=1e-6)


def test_a_network_at_death_has_the_learned_weights(study: bl.Study, tmp_path: Path) -> None:
    trace = study.replay(run=1, generation=2)
    for moment, name in MOMENTS:
        path = tmp_path / f"{moment}.onnx"
        study.export(path, run=1, generation=2, agent=7, at=moment)
        weights = trace[name].values[7, 0]
        hidden = 1 / (1 + np.exp(-INPUTS @ weights[:30].reshape(3, 10)))
        expected = 1 / (1 + np.exp(-hidden @ weights[30:].reshape(10, 3)))
        np.testing.assert_allclose(evaluate(path, INPUTS), expected, atol=1e-6)
    assert not np.array_equal(trace.weight_birth[7, 0], trace.weight_death[7, 0])


def test_the_command_export_writes_a_network(
    study: bl.Study, command: Command, tmp_path: Path
) -> None:
    agent = ("--run", "0", "--generation", "1", "--agent", "2")
    outcome = command("export", str(study.directory), *agent, "--at", "death", "--out", "a.onnx")
    assert outcome.out == "a.onnx: 60 weights at death\n", outcome.err
    properties = runtime.InferenceSession(str(tmp_path / "a.onnx")).get_modelmeta()
    assert properties.producer_name == "baldwinlab export"
    assert properties.custom_metadata_map["agent"] == "2"


@pytest.mark.nightly
def test_a_network_of_another_kind_is_refused(tmp_path: Path) -> None:
    experiment = shorten_preset("evo/A").replace(
        network={"kind": "simple-recurrent"}, lifetime={"steps": 20}, evolution={"generations": 1}
    )
    study = bl.run(experiment, runs=1, out=tmp_path / "study")
    with pytest.raises(BaldwinLabError, match=r"needs network\.kind = 'feed-forward'"):
        study.export(tmp_path / "a.onnx", run=0, generation=0, agent=0)
