"""Write the network of an agent as ONNX, the format of networks that many libraries read."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.api.agents import make_network, read_genomes, select_condition
from baldwinlab.api.export.formats import ExportFormat, Option
from baldwinlab.api.export.phylogeny import OPTIONS_OF_RUN, choose_run
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import EXPORT_MARK, require_writable
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import require_single_species
from baldwinlab.simulation.reevaluation import make_batch
from baldwinlab.studies.store import StudyStore

Moment = Literal["birth", "death"]
# Old versions of the operators and of the format, which all recent runtimes can read.
OPERATOR_SET_VERSION: Final = 13
FORMAT_VERSION: Final = 8


def write_onnx(
    study: StudyStore,
    path: Path,
    *,
    generation: int,
    agent: int,
    condition: str | None = None,
    run: int | None = None,
    at: Moment = "birth",
    force: bool = False,
) -> str:
    """Write the action network of an agent as ONNX, and return the number of weights as text."""
    import onnx

    require_writable("--out", path, EXPORT_MARK.encode(), force=force)
    name = select_condition(study, condition)
    run_index = choose_run(study, name, run)
    experiment = study.experiment(name).at(generation)
    _require_feed_forward(experiment, at)
    network = make_network(study, name, run_index, generation, agent, module="action")
    weights = network.weights.values
    if at == "death":
        weights = _weights_at_death(study, name, run_index, generation, agent)
    origin = {
        "condition": name,
        "seed": str(study.seed),
        "run": str(run_index),
        "generation": str(generation),
        "agent": str(agent),
        "moment": at,
        "inputs": json.dumps(list(network.inputs)),
        "outputs": json.dumps(list(network.outputs)),
    }
    write_atomically(path, _encode(onnx, experiment, weights, origin))
    return f"{path}: {weights.size:,} weights at {at}"


def _require_feed_forward(experiment: BaseExperiment, moment: Moment) -> None:
    kind = experiment.network.kind if isinstance(experiment, Experiment) else experiment.model
    if kind != "feed-forward":
        raise RefusedError(
            f"{experiment.name} has networks of the kind {kind!r}; --format onnx needs "
            "network.kind = 'feed-forward'"
        )
    require_single_species(experiment, "a network as ONNX")
    if moment == "death" and experiment.births_in_life:
        raise RefusedError(
            f"{experiment.name} has births during life, so that an agent can have another place at "
            "its death; use --at birth"
        )


def _weights_at_death(
    study: StudyStore, condition: str, run: int, generation: int, agent: int
) -> npt.NDArray[np.float32]:
    """Simulate the lifetime of a generation, and return the weights [weight] of one agent."""
    experiment = study.experiment(condition)
    genome = read_genomes(study, condition, run, generation, None).values
    batch = make_batch(experiment, study.seed, [run], generation, genome[None])
    batch.simulate(0, experiment.lifetime.steps)
    # [run, agent, weight]
    return batch.weights()[0, agent, : experiment.weight_count].copy()


def _encode(
    onnx: Any, experiment: Experiment, weights: npt.NDArray[np.float32], origin: dict[str, str]
) -> bytes:
    """Return the bytes of a network with the input `inputs` and the output `outputs`.

    `weights` [weight]: for each layer the matrix [source unit, target unit], then the biases.
    """
    helper = onnx.helper
    sizes = experiment.layer_sizes
    # Layer 0 has the links from the inputs to the next units, so n sizes have n - 1 layers.
    last_layer = len(sizes) - 2
    nodes = []
    arrays = []
    source = "inputs"
    start = 0
    for layer, (n_sources, n_targets) in enumerate(pairwise(sizes)):
        end = start + n_sources * n_targets
        matrix = weights[start:end].reshape(n_sources, n_targets)
        arrays.append(onnx.numpy_helper.from_array(matrix, f"weights_{layer}"))
        nodes.append(helper.make_node("MatMul", [source, f"weights_{layer}"], [f"sum_{layer}"]))
        source = f"sum_{layer}"
        if experiment.network.biases:
            biases = weights[end : end + n_targets]
            arrays.append(onnx.numpy_helper.from_array(biases, f"biases_{layer}"))
            nodes.append(helper.make_node("Add", [source, f"biases_{layer}"], [f"biased_{layer}"]))
            source = f"biased_{layer}"
            end += n_targets
        target = "outputs" if layer == last_layer else f"activations_{layer}"
        nodes.append(helper.make_node("Sigmoid", [source], [target]))
        source = target
        start = end
    value_type = onnx.TensorProto.FLOAT
    graph = helper.make_graph(
        nodes,
        "action",
        [helper.make_tensor_value_info("inputs", value_type, ["step", sizes[0]])],
        [helper.make_tensor_value_info("outputs", value_type, ["step", sizes[-1]])],
        arrays,
    )
    model = helper.make_model(
        graph,
        producer_name=EXPORT_MARK,
        producer_version=__version__,
        opset_imports=[helper.make_opsetid("", OPERATOR_SET_VERSION)],
        ir_version=FORMAT_VERSION,
    )
    helper.set_model_props(model, origin)
    onnx.checker.check_model(model)
    return bytes(model.SerializeToString(deterministic=True))


FORMAT: Final = ExportFormat(
    name="onnx",
    content="the feed-forward network of an agent, at birth or at death",
    write=write_onnx,
    suffix=".onnx",
    options=(
        *OPTIONS_OF_RUN,
        Option("generation", int, "number of a generation, from 0. No default.", is_required=True),
        Option("agent", int, "number of an agent, from 0. No default.", is_required=True),
        Option("at", Moment, "weights at birth or at death. Default: birth."),
    ),
    library="onnx",
    extra="exchange",
    uses_parts=True,
)
