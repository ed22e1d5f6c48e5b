"""Check parts against the contract: built-in parts and examples fulfill it, wrong parts fail."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.api.checks import REQUIREMENTS
from baldwinlab.core.errors import ArgumentError
from baldwinlab.experiment import registry
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.parts import PartError, load_file
from baldwinlab.simulation.simulate import simulate
from tests.commands import Command
from tests.oracles.parts import check_built_in_parts

Write = Callable[[str], Path]
EXAMPLES = sorted((Path(__file__).parents[3] / "examples" / "parts").glob("*.py"))
CHECKED = [name for name in REQUIREMENTS if name not in ("speed", "simulator")]

RULE = """
import numpy as np
from baldwinlab.parts import Field, LearningRule, compiled, get, per_agent, put
{above}

class MyRule(LearningRule, name="{name}"):
    {fields}
    @staticmethod
    def learn({arguments}):
        {learn}

    @staticmethod
    def oracle(part, agents, agent, naive):
        {oracle}
"""
INCREASE_WEIGHT = "put(state.weights, 0, lane, get(state.weights, 0, lane) + np.float32(0.125))"


@pytest.fixture
def write(write_part: Write) -> Any:
    """Write a file with a learning rule. By default, the first weight increases."""

    def write(learn: str = INCREASE_WEIGHT, **changes: str) -> Path:
        texts = {
            "above": "",
            "name": "my-rule",
            "fields": "",
            "arguments": "part, model, state, step, lane",
            "oracle": "agent.action_module[0][0][0] += 0.125",
            "learn": learn,
        }
        return write_part(RULE.format(**texts | changes))

    return write


def failures(path: Path, *requirements: str) -> str:
    findings = bl.check_part(path, requirements=requirements)
    return "\n".join(str(finding) for finding in findings if finding.holds is False)


def built_in_parts() -> list[Any]:
    kinds = [kind for kind in BUILT_IN if kind != "model"]
    return [
        registry.find_class(kind, name)
        for kind in kinds
        for name in sorted(BUILT_IN[kind], reverse=True)
    ]


# The checks compile the step for each part, which takes half a minute or more.
@pytest.mark.nightly
def test_the_built_in_parts_fulfill_the_contract() -> None:
    findings = check_built_in_parts(built_in_parts(), requirements=CHECKED)
    verified = [finding for finding in findings if not finding.is_unverified]
    assert [str(finding) for finding in verified if not finding.holds] == []
    assert {finding.message for finding in findings if finding.is_unverified} == {
        "network 'feed-forward', backward",
        "selection 'neutral', mark_survivors",
    }


# Each example is a new combination of parts, which takes ten seconds or more to compile.
@pytest.mark.nightly
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: str(path.stem))
def test_the_examples_fulfill_the_contract(example: Path) -> None:
    findings = bl.check_part(example, requirements=CHECKED)
    assert all(finding.holds is not False for finding in findings), "\n".join(map(str, findings))


def test_a_correct_rule_fulfills_the_contract(write: Any, without_compilation: None) -> None:
    assert failures(write(), "fields", "limits", "signature", "isolation", "oracle") == ""


@pytest.mark.parametrize(
    "learn",
    [
        "put(state.weights, 0, lane, get(state.weights, 0, lane + 1))",
        "put(state.weights, 0, lane, get(state.weights, 0, 3))",
        "eaten = state.eaten_in_life; put(state.weights, 0, lane, np.float32(eaten[0, 3]))",
        "put(state.weights, 0, 3, get(state.weights, 0, lane))",
        "put(state.weights, 0, lane, get(part.trace, 0, 3))",
        "put(state.weights, 0, lane, neighbor(state.weights, lane))",
        "backward(state.network, Training(1, state.weights, state.activations, 1, 1), 3)",
        "lane = 3",
    ],
)
def test_a_rule_that_reads_a_neighbor_is_refused_before_it_runs(write: Any, learn: str) -> None:
    above = "def neighbor(rows, lane):\n    return get(rows, 0, lane - 1)\n"
    path = write(learn, above=above, fields='arrays = {"trace": per_agent("weights")}')
    message = r"MyRule.learn reads or writes other agents \(.*part.py:\d+: .*\); .* own lane"
    with pytest.raises(PartError, match=message):
        load_file(path)
    assert ("learning rule", "my-rule") not in registry.custom_parts()


def test_a_rule_that_loads_the_genes_of_a_neighbor_is_refused(write: Any) -> None:
    load_genes = (
        "@staticmethod\n"
        "    def load_genes(part, model, state, genes, lane):\n"
        "        put(state.weights, 0, lane, {})"
    )
    assert failures(write(fields=load_genes.format("get(genes, 0, lane)")), "fields") == ""
    with pytest.raises(PartError, match=r"MyRule.load_genes reads or writes other agents"):
        load_file(write(fields=load_genes.format("get(genes, 0, lane + 1)")))


def test_a_read_of_a_neighbor_through_a_global_function_fails(
    write: Any, without_compilation: None
) -> None:
    peek = "peek = compiled(lambda rows: rows[0, 3])"
    path = write("put(state.weights, 0, lane, peek(state.weights))", above=peek)
    message = "MyRule.learn makes weights of an agent depend on other agents"
    assert message in failures(path, "isolation")


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (
            "np.float32(np.exp(np.float32(state.rate.shape[0] + step)))",
            r"calls \S+, which differs between machines",
        ),
        (
            "np.float32(part.share * 0.3)",
            r"calculates in float64: constants must be float32, such as np.float32\(0.5\)",
        ),
        pytest.param(
            "get(state.rate, 0, lane) * part.count",
            "calculates in float64: an integer and a float32 make a float64; write np.float32",
            marks=pytest.mark.nightly,
        ),
        ("np.float32(np.random.random())", "draws random numbers that do not depend on the seed"),
    ],
    ids=["library", "constant", "integer", "random numbers"],
)
def test_arithmetic_that_is_not_portable_fails_with_the_reason(
    write: Any, value: str, reason: str
) -> None:
    path = write(f"put(state.rate, 0, lane, {value})", fields="share: float = 0.1; count: int = 2")
    assert re.search(f"MyRule.learn {reason}", failures(path, "arithmetic"))


@pytest.mark.nightly
def test_runs_with_such_random_numbers_differ_when_they_are_repeated(
    write: Any, without_compilation: None
) -> None:
    path = write("put(state.weights, 0, lane, np.float32(np.random.random()))")
    message = "learning rule 'my-rule' (learn): under the simultaneous update, the same runs"
    assert message in failures(path, "repeated")


def test_a_wrong_oracle_fails_in_worlds_that_depend_on_the_seed(
    write: Any, without_compilation: None
) -> None:
    text = failures(write(oracle="agent.action_module[0][0][0] += 0.25"), "oracle")
    assert "learning rule 'my-rule': learn: after step 0, agent 0: weight 0 is" in text
    assert "to repeat: baldwinlab check" in text
    assert "--requirements oracle" in text
    path = write(oracle="agent.action_module[0][0][0] += 0.25")
    texts = {
        seed: str(bl.check_part(path, requirements=["oracle"], seed=seed)[-1]) for seed in (11, 12)
    }
    assert texts[11].endswith("--requirements oracle")
    assert texts[11].partition("weight 0 is")[2] != texts[12].partition("weight 0 is")[2]
    assert texts[12].endswith(f"to repeat: baldwinlab check {path} --requirements oracle --seed 12")
    with pytest.raises(ArgumentError, match="seed = -1 must be a whole number from 0"):
        bl.check_part(path, seed=-1)
    message = "requirements = 'everything' must be one of fields, limits"
    with pytest.raises(ArgumentError, match=message):
        bl.check_part(path, requirements=["everything"])


UNCOMPILED = {
    "part.nothing": "Unknown attribute 'nothing'",
    'get(state.weights, 0, lane) + "x"': "No implementation of function",
    "nothing": "name 'nothing' is not defined",
    "not_compiled(state.weights, lane)": "Untyped global name 'not_compiled'",
}


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        pytest.param(*case, marks=[pytest.mark.nightly] * (case[0] != "part.nothing"))
        for case in UNCOMPILED.items()
    ],
)
def test_a_rule_that_does_not_compile_fails_with_one_line(
    write: Any, value: str, reason: str
) -> None:
    learn = f"put(state.weights, 0, lane, {value})"
    path = write(learn, above="def not_compiled(rows, lane):\n    return rows[0, lane]\n")
    text = failures(path, "arithmetic")
    assert f"MyRule.learn cannot be compiled ({path}:" in text
    assert reason in text
    assert len(text.splitlines()) == 1


@pytest.mark.nightly
def test_a_simulation_reports_a_rule_that_does_not_compile(write: Any) -> None:
    path = write("put(state.weights, 0, lane, part.nothing)")
    finding = bl.check_part(path, requirements=["compiles", "repeated"])[-1]
    assert "does not hold: it compiles: MyRule.learn cannot be compiled (" in str(finding)
    experiment = bl.load("evo/A").replace(
        learning={"rule": "my-rule"}, lifetime={"steps": 1}, evolution={"generations": 1}
    )
    with pytest.raises(
        PartError,
        match=r"MyRule.learn cannot be compiled \(.*part.py:\d+\): Unknown attribute 'nothing'",
    ):
        simulate(experiment)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"name": "self-taught"}, "'self-taught' is a built-in learning rule"),
        (
            {"arguments": "part, lane"},
            "MyRule.learn must have the arguments of its kind: "
            "learn(part, model, state, step, lane)",
        ),
        ({"above": "1 / 0"}, "cannot be loaded: ZeroDivisionError"),
    ],
)
def test_a_part_that_does_not_load_fails_with_the_reason(
    write: Any, changes: dict[str, str], reason: str
) -> None:
    text = failures(write(**changes))
    assert text.startswith("does not hold: it loads: ")
    assert reason in text


def test_fields_without_limits_or_description_fail(write: Any) -> None:
    for value, message in (
        ("0.1", "MyRule.share has no description"),
        ('Field(0.1, description="?")', "MyRule.share has no limits"),
        ('Field(0.1, ge=0, description="?")', "MyRule.share has no limits"),
    ):
        assert message in failures(write(fields=f"share: float = {value}"), "fields")


def test_the_command_prints_the_failure_and_exits_with_1(write: Any, command: Command) -> None:
    for fields, status in (("", 0), ("share: float = 0.1", 1)):
        path = str(write(fields=fields))
        done = command("check", path, "--requirements", "fields", "--seed", "3")
        assert done.code == status
    message = "does not hold: its fields have limits and a description: MyRule.share"
    assert message in done.out + done.err


SENSE = """
import numpy as np
from baldwinlab.parts import Sense, per_agent

class Height(Sense, name="height"):
    inputs = ("height",)
    sectors = (None,)
    is_continuous = True

    @staticmethod
    def measure(part, model, state, world, agent):
        lane = world * model.agents + agent
        state.activations[part.first_input, lane] = {measured}

    @staticmethod
    def oracle(part, agent, items, naive):
        return [{expected}]
"""
CORRECT = "state.positions[1, lane] / model.height"


def sense_failures(
    write_part: Write, measured: str, expected: str = "agent.y / naive.height"
) -> str:
    path = write_part(SENSE.format(measured=measured, expected=expected))
    # The words of the random number generator overflow by design.
    with np.errstate(all="ignore"):
        return failures(path, "fields", "isolation", "oracle")


@pytest.mark.usefixtures("without_compilation")
def test_an_input_can_be_any_finite_number_that_agrees_with_the_oracle(write_part: Write) -> None:
    assert sense_failures(write_part, CORRECT) == ""
    assert sense_failures(write_part, "-state.positions[1, lane]", "-agent.y") == ""
    is_infinite = sense_failures(write_part, "np.float32(np.inf)", "float('inf')")
    assert "each must be a finite number" in is_infinite
    assert "and by the oracle" in sense_failures(write_part, f"np.float32(0.99) * {CORRECT}")


def test_a_sense_that_reads_a_neighbor_is_refused_before_it_runs(write_part: Write) -> None:
    neighbor = "state.positions[1, lane + 1] / model.height"
    path = write_part(SENSE.format(measured=neighbor, expected="0.0"))
    with pytest.raises(PartError, match=r"Height\.measure reads or writes other agents"):
        load_file(path)


@pytest.mark.usefixtures("without_compilation")
def test_an_error_of_an_oracle_lists_the_attributes_of_an_agent(write_part: Write) -> None:
    message = sense_failures(write_part, CORRECT, "agent.age")
    assert "no attribute 'age'; it has action, action_module, arrays, eaten_in_life" in message
