"""Run the modules of an exported page in Node, which is faster than a browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.lab.pages import single_page

VARIABLES = ("food_eaten", "energy", "parents", "genome")
SIMULATE = """(program, experiment) => {
  const arrays = Object.entries(simulate(program, experiment, 5, 1));
  return Object.fromEntries(arrays.map(([name, array]) => [name, Array.from(array)]));
}"""
SCRIPT = """
import { readFileSync } from "node:fs";
import { compileProgram } from "./engine.js";
import { Run, simulate } from "./simulation.js";
const evaluate = FUNCTION;
const results = {};
for (const { name, plan, experiment, module } of JSON.parse(readFileSync("input.json"))) {
  const program = await compileProgram(readFileSync(module), plan);
  results[name] = evaluate(program, experiment);
}
console.log(JSON.stringify(results));
"""


class NodeRun(NamedTuple):
    """Run 1 of an experiment with seed 5, in a compiled module with a plan."""

    experiment: Experiment
    module: Path
    plan: Mapping[str, Any]


def run_in_node(
    folder: Path, runs: Mapping[str, NodeRun], function: str = SIMULATE
) -> dict[str, Any]:
    """Return the result of the JavaScript `function`(program, experiment) for each run, by name."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    for name in ("engine/engine.js", "engine/simulation.js"):
        shutil.copy(single_page.STATIC_FOLDER / name, folder)
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "run.js").write_text(SCRIPT.replace("FUNCTION", function))
    script_input = [
        {
            "name": name,
            "plan": run.plan,
            "experiment": run.experiment.to_dict(),
            "module": str(run.module),
        }
        for name, run in runs.items()
    ]
    (folder / "input.json").write_text(json.dumps(script_input))
    done = subprocess.run([node, "run.js"], cwd=folder, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout))


def check_bits(actual: Mapping[str, Any], expected: xr.Dataset, name: str) -> None:
    """Require that a result of `SIMULATE` has the bits of a run in Python."""
    for variable in VARIABLES:
        values = expected[variable].values
        array = np.array(actual[variable], values.dtype)
        assert array.tobytes() == values.tobytes(), (name, variable)
