"""The contract of a part: the built-in parts and the examples keep it, and parts that lie are found out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.api.checks import REQUIREMENTS
from baldwinlab.cli import main
from baldwinlab.core.errors import ArgumentError
from baldwinlab.experiment import registry
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.parts import PartError, load_file
from baldwinlab.simulation.simulate import simulate

EXAMPLES = sorted((Path(__file__).parents[3] / "examples" / "parts").glob("*.py"))
TRIED = [name for name in REQUIREMENTS if name not in ("speed", "simulator")]

RULE = """
import numpy as np
from baldwinlab.parts import Field, LearningRule, compiled, get, per_agent, put
{above}

class Liar(LearningRule, name="{name}"):
    {fields}
    @staticmethod
    def learn({arguments}):
        {learn}

    @staticmethod
    def oracle(part, agents, agent, naive):
        {oracle}
"""
GROWS = "put(state.weights, 0, lane, get(state.weights, 0, lane) + np.float32(0.125))"


@pytest.fixture
def write(tmp_path: Path) -> Any:
    """Writes a file with a learning rule; what is not said otherwise is a rule by which the first weight grows."""
    before = registry.custom_parts()

    def write(learn: str = GROWS, **changes: str) -> Path:
        told = {
            "above": "",
            "name": "liar",
            "fields": "",
            "arguments": "part, model, state, step, lane",
        }
        told["oracle"] = "agent.action_module[0][0][0] += 0.125"
        path = tmp_path / "liar.py"
        path.write_text(RULE.format(**told | {"learn": learn} | changes))
        return path

    yield write
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)


def failures(path: Path, *only: str) -> str:
    return "\n".join(
        str(found) for found in bl.check_part(path, requirements=only) if found.holds is False
    )


def built_in_parts() -> list[Any]:
    kinds = [kind for kind in BUILT_IN if kind != "model"]
    return [
        registry.find(kind, name) for kind in kinds for name in sorted(BUILT_IN[kind], reverse=True)
    ]


def test_the_built_in_parts_keep_the_contract() -> None:
    found = bl.check_part(built_in_parts(), requirements=TRIED)
    assert [str(each) for each in found if not each.holds and not each.is_unverified] == []
    unverified = {each.sentence for each in found if each.is_unverified}
    assert unverified == {
        "network 'feed-forward', backward", "learning rule 'drift', init_agent", "selection 'neutral', mark_survivors",
    }  # fmt: skip


@pytest.mark.nightly  # a combination of parts takes ten seconds and more to compile, and each example has its own
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: str(path.stem))
def test_the_examples_keep_the_contract(example: Path) -> None:
    found = bl.check_part(example, requirements=TRIED)
    assert all(each.holds is not False for each in found), "\n".join(map(str, found))


def test_a_rule_that_tells_the_truth_keeps_the_contract(
    write: Any, without_compilation: None
) -> None:
    assert failures(write(), "fields", "limits", "signature", "others", "oracle") == ""


@pytest.mark.parametrize(
    "learn",
    [
        "put(state.weights, 0, lane, get(state.weights, 0, lane + 1))",
        "put(state.weights, 0, lane, get(state.weights, 0, 3))",
        "others = state.eaten_in_life; put(state.weights, 0, lane, np.float32(others[0, 3]))",
        "put(state.weights, 0, 3, get(state.weights, 0, lane))",
        "put(state.weights, 0, lane, get(part.trace, 0, 3))",
        "put(state.weights, 0, lane, neighbour(state.weights, lane))",
        "lane = 3",
    ],
)
def test_a_rule_that_looks_at_a_neighbour_is_refused_before_it_runs(write: Any, learn: str) -> None:
    above = "def neighbour(rows, lane):\n    return get(rows, 0, lane - 1)\n"
    path = write(learn, above=above, fields='arrays = {"trace": per_agent("weights")}')
    with pytest.raises(
        PartError,
        match=r"Liar.learn reads or writes other agents \(.*liar.py:\d+: .*\); .* with its own lane",
    ):
        load_file(path)
    assert ("learning rule", "liar") not in registry.custom_parts()


def test_so_is_one_that_inherits_what_is_a_neighbours(write: Any) -> None:
    inherits = "@staticmethod\n    def load_genes(part, model, state, genes, lane):\n        put(state.weights, 0, lane, {})"
    assert failures(write(fields=inherits.format("get(genes, 0, lane)")), "fields") == ""
    with pytest.raises(PartError, match=r"Liar.load_genes reads or writes other agents"):
        load_file(write(fields=inherits.format("get(genes, 0, lane + 1)")))


def test_a_look_at_a_neighbour_that_the_source_hides_is_found(
    write: Any, without_compilation: None
) -> None:
    peek = "peek = compiled(lambda rows: rows[0, 3])"
    path = write("put(state.weights, 0, lane, peek(state.weights))", above=peek)
    assert "Liar.learn makes weights of an agent depend on other agents" in failures(path, "others")


def test_a_call_of_the_mathematical_library_is_found(write: Any) -> None:
    path = write(
        "put(state.rate, 0, lane, np.float32(np.exp(np.float32(state.rate.shape[0] + step))))"
    )
    assert "Liar.learn calls" in failures(path, "arithmetic")
    assert "has other bits elsewhere" in failures(path, "arithmetic")


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("np.float32(part.share * 0.3)", "constants must be float32, such as np.float32(0.5)"),
        (
            "get(state.rate, 0, lane) * part.count",
            "an integer and a float32 make a float64; write np.float32(n)",
        ),
    ],
)
def test_arithmetic_in_float64_is_found_with_its_reason(
    write: Any, value: str, reason: str
) -> None:
    path = write(f"put(state.rate, 0, lane, {value})", fields="share: float = 0.1; count: int = 2")
    assert f"Liar.learn calculates in float64: {reason}" in failures(path, "arithmetic")


def test_random_numbers_that_no_seed_decides_are_found(write: Any) -> None:
    path = write("put(state.weights, 0, lane, np.float32(np.random.random()))")
    assert "Liar.learn draws random numbers that no seed decides" in failures(path, "arithmetic")


def test_so_are_their_lives_which_have_other_bits_a_second_time(
    write: Any, without_compilation: None
) -> None:
    path = write("put(state.weights, 0, lane, np.float32(np.random.random()))")
    assert "learning rule 'liar' (learn): under the simultaneous update, the same runs" in failures(
        path, "again"
    )


def test_an_oracle_that_disagrees_is_found(write: Any, without_compilation: None) -> None:
    found = failures(write(oracle="agent.action_module[0][0][0] += 0.25"), "oracle")
    assert "learning rule 'liar': learn: after step 0, agent 0: weight 0 is" in found
    assert "again: baldwinlab check" in found
    assert "--requirements oracle" in found


def test_another_seed_tries_other_worlds(write: Any, without_compilation: None) -> None:
    path = write(oracle="agent.action_module[0][0][0] += 0.25")
    found = {
        seed: str(bl.check_part(path, requirements=["oracle"], seed=seed)[-1]) for seed in (11, 12)
    }
    assert found[11].endswith("--requirements oracle")
    assert found[11].partition("weight 0 is")[2] != found[12].partition("weight 0 is")[2]
    assert found[12].endswith(f"again: baldwinlab check {path} --requirements oracle --seed 12")
    with pytest.raises(ArgumentError, match="seed = -1 must be at least 0"):
        bl.check_part(path, seed=-1)


@pytest.mark.parametrize(
    ("learn", "reason"),
    [
        ("put(state.weights, 0, lane, part.nothing)", "Unknown attribute 'nothing'"),
        (
            'put(state.weights, 0, lane, get(state.weights, 0, lane) + "x")',
            "No implementation of function",
        ),
        ("put(state.weights, 0, lane, nothing)", "name 'nothing' is not defined"),
        (
            "put(state.weights, 0, lane, not_compiled(state.weights, lane))",
            "Untyped global name 'not_compiled'",
        ),
    ],
)
def test_what_does_not_compile_is_told_in_one_sentence(write: Any, learn: str, reason: str) -> None:
    path = write(learn, above="def not_compiled(rows, lane):\n    return rows[0, lane]\n")
    told = failures(path, "arithmetic")
    assert f"Liar.learn cannot be compiled ({path}:" in told
    assert reason in told
    assert len(told.splitlines()) == 1


def test_where_lives_are_lived_that_is_a_sentence_too(write: Any) -> None:
    path = write("put(state.weights, 0, lane, part.nothing)")
    found = bl.check_part(path, requirements=["compiles", "again"])
    assert "does not hold: it compiles: Liar.learn cannot be compiled (" in str(found[-1])
    experiment = bl.load("evo/A").replace(
        learning={"rule": "liar"}, lifetime={"steps": 1}, evolution={"generations": 1}
    )
    with pytest.raises(
        PartError,
        match=r"Liar.learn cannot be compiled \(.*liar.py:\d+\): Unknown attribute 'nothing'",
    ):
        simulate(experiment)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"name": "self-taught"}, "'self-taught' is a built-in learning rule"),
        (
            {"arguments": "part, lane"},
            "Liar.learn must have the arguments of its kind: learn(part, model, state, step, lane)",
        ),
        ({"above": "1 / 0"}, "cannot be loaded: ZeroDivisionError"),
    ],
)
def test_what_does_not_load_is_told_in_one_sentence(
    write: Any, changes: dict[str, str], reason: str
) -> None:
    told = failures(write(**changes))
    assert told.startswith("does not hold: it loads: ")
    assert reason in told


def test_numbers_without_limits_or_meaning_are_found(write: Any) -> None:
    assert "Liar.share has no description" in failures(write(fields="share: float = 0.1"), "fields")
    assert "Liar.share has no limits" in failures(
        write(fields='share: float = Field(0.1, description="?")'), "fields"
    )
    half = 'share: float = Field(0.1, ge=0, description="?")'
    assert "Liar.share has no limits" in failures(write(fields=half), "fields")


def test_the_command_says_what_fails_and_ends_with_1(
    write: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    for fields, status in (("", 0), ("share: float = 0.1", 1)):
        with pytest.raises(SystemExit) as end:
            main_with(
                ["check", str(write(fields=fields)), "--requirements", "fields", "--seed", "3"]
            )
        assert end.value.code == status
    told = capsys.readouterr()
    assert "does not hold: its fields have limits and a meaning: Liar.share" in told.out + told.err


def main_with(words: list[str]) -> None:
    import sys

    before, sys.argv = sys.argv, ["baldwinlab", *words]
    try:
        main()
        sys.exit(0)
    finally:
        sys.argv = before


def test_an_unknown_requirement_is_refused(write: Any) -> None:
    with pytest.raises(
        ArgumentError, match="requirements = 'everything' must be one of fields, limits"
    ):
        bl.check_part(write(), requirements=["everything"])
