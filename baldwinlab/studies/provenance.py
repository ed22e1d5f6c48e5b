"""Provenance of a study: software versions, platform and computing time."""

from __future__ import annotations

import platform
from importlib.metadata import version
from typing import Any

import numpy as np

from baldwinlab._version import __version__
from baldwinlab.studies.run_samples import describe_sample
from baldwinlab.studies.store import StudyStore


def provenance(study: StudyStore) -> dict[str, Any]:
    """Return the provenance of a study for its report.

    Returns seed, sentences about the changed model and a sample of the runs, versions, platform,
    and the agent-steps, seconds and numbers of workers of all sessions.
    """
    sessions = list(study.sessions())
    return {
        "seed": study.seed,
        "changed_model": study.changed_model,
        "sample": describe_sample(study),
        "versions": {
            "baldwinlab": __version__,
            "Python": platform.python_version(),
            "NumPy": np.__version__,
            "Numba": version("numba"),
        },
        "platform": platform.platform(),
        "agent_steps": sum(session["agent_steps"] for session in sessions),
        "seconds": sum(session["seconds"] for session in sessions),
        "compile_seconds": sum(session["compile_seconds"] for session in sessions),
        "workers": sorted({session["workers"] for session in sessions}),
    }
