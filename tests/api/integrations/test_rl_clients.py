"""Contract tests with libraries of reinforcement learning, in their own environment."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.api.integrations.rl_clients import run_client

pytestmark = pytest.mark.nightly


@pytest.mark.parametrize("start_method", ["spawn", "forkserver", "fork"])
def test_stable_baselines_trains_in_two_processes(start_method: str) -> None:
    assert run_client("train", start_method) == 2_000


def test_supersuit_steps_two_worlds_in_two_processes() -> None:
    result = run_client("supersuit")
    # Two worlds of four agents, each with three frames of three inputs. One lifetime ends.
    assert result == {"shape": [8, 9], "ends": 8}


def test_gymnasium_records_a_video_and_opens_a_window(tmp_path: Path) -> None:
    assert run_client("video", tmp_path) == ["rl-video-episode-0.mp4"]
