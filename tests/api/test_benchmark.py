"""The benchmark measures what it says, on small cases."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from baldwinlab import cli
from baldwinlab.api import benchmark
from baldwinlab.papers.presets import paper

EXAMPLES = Path(__file__).parents[2] / "examples" / "parts"


@pytest.mark.parametrize(
    "case", ["evo/B", "world-20", pytest.param("world-10000", marks=pytest.mark.nightly)]
)
def test_a_case_is_measured_with_its_cost(case: str) -> None:
    record = benchmark.measure(case, quick=True)
    assert record.case == case
    assert record.agent_steps_per_second > 0
    assert record.seconds > 0
    assert record.threads == 1
    assert record.peak_mib is not None and record.peak_mib > 50


def test_there_is_a_case_for_the_study_for_every_condition_and_for_large_worlds() -> None:
    assert {"study", "world-10000", *(experiment.name for experiment in paper())} <= set(
        benchmark.cases()
    )
    assert "world-10000" not in benchmark.cases("cuda")


@pytest.mark.nightly
def test_every_learning_rule_is_a_case_with_all_rules(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert {"rule-none", "rule-self-taught", "rule-prediction"} <= set(benchmark.rule_cases())
    monkeypatch.setattr(benchmark, "cases", lambda backend: [])
    monkeypatch.setattr(benchmark, "rule_cases", lambda: ["rule-none"])
    assert list(benchmark.measure_cases(True, "cpu")) == []
    (record,) = benchmark.measure_cases(True, "cpu", all_rules=True)
    assert record.case == "rule-none"
    assert record.agent_steps_per_second > 0


def test_a_crowd_has_the_density_of_the_paper() -> None:
    for agents in (20, 2000):
        experiment = benchmark.many_agent_experiment(agents, steps=10)
        (region,) = experiment.world.food
        area = (region.x[1] - region.x[0]) * (region.y[1] - region.y[0])
        assert region.count / area == pytest.approx(50 / 160**2)
        assert agents / (experiment.world.width * experiment.world.height) == pytest.approx(
            20 / 640**2
        )


@pytest.mark.nightly
def test_the_parts_of_a_file_are_a_case_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark, "cases", lambda backend: [])
    (record,) = benchmark.measure_cases(True, "cpu", [EXAMPLES / "bit_strings.py"])
    assert record.case == "bit_strings"
    assert record.agent_steps_per_second > 0


@pytest.mark.nightly
def test_the_command_prints_a_line_a_case_and_writes_the_records(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(benchmark, "cases", lambda backend: ["evo/A", "evo/B"])
    monkeypatch.setattr(
        sys, "argv", ["baldwinlab", "bench", "--quick", "--out", str(tmp_path / "bench.json")]
    )
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert not end.value.code
    shown = capsys.readouterr().out.splitlines()
    contents = json.loads((tmp_path / "bench.json").read_text())
    assert (
        [line.split()[0] for line in shown[1:3]]
        == [record["case"] for record in contents["records"]]
        == ["evo/A", "evo/B"]
    )
    assert {"processor", "cores", "numba"} <= set(contents["machine"])
