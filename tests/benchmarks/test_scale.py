"""The cases and the tables of the benchmark of scale."""

from __future__ import annotations

from benchmarks.scale import NOT_MEASURED, format_rows, list_cases


def test_the_limit_applies_to_runs_and_agents() -> None:
    cases = list_cases(1000)
    assert [(case.quantity, case.size) for case in cases] == [
        ("runs", 100),
        ("agents", 20),
        ("agents", 1000),
        ("threads", 1),
        ("threads", 2),
        ("threads of one world", 1),
        ("threads of one world", 2),
    ]
    # 100 runs of 2 generations of 20 steps with 4 agents.
    assert cases[0].agent_steps == 16_000
    # All numbers of agents have equal amounts of work.
    assert cases[1].agent_steps == cases[2].agent_steps


def test_the_ratio_of_speeds_is_that_of_the_medians() -> None:
    rows = [
        {"quantity": "runs", "size": 100, "now": [1.0, 2.0, 9.0], "earlier": [6.0, 8.0, 7.0]},
        {"quantity": "runs", "size": 100_000, "now": [2.0], "earlier": []},
    ]
    lines = format_rows(rows).splitlines()
    assert lines[2] == "| runs | 100 | 2 | 7 | 3.50 |"
    assert lines[3] == f"| runs | 100,000 | 2 | {NOT_MEASURED} | {NOT_MEASURED} |"
