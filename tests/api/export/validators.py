"""Validate files with libraries of a separate environment, which `make nightly` installs.

A test calls `validate`. The Python of that environment runs this file as a script, which prints the
result as JSON.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

PYTHON = Path(sys.prefix, "nightly", "bin", "python")


def validate(kind: str, *arguments: object) -> Any:
    """Run `validate_crate` or `validate_phylogeny` in the separate environment."""
    # The separate environment has no pytest.
    import pytest

    if not PYTHON.exists():
        pytest.skip(f"make nightly installs the validators into {PYTHON.parents[1]}")
    command = [str(PYTHON), __file__, kind, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def validate_crate(folder: str, severity: str, context: str) -> dict[str, list[str]]:
    """Return the message of each issue with its entities.

    The validator requests the terms of the specification from the network. The answer is `context`
    instead, the file of the library `rocrate` with these terms.
    """
    import requests
    from rocrate_validator import models, services

    def answer(self: object, request: requests.PreparedRequest, **_: object) -> requests.Response:
        assert request.url == "https://w3id.org/ro/crate/1.1/context"
        response = requests.Response()
        response.status_code, response.url, response.request = 200, str(request.url), request
        response._content = Path(context).read_bytes()
        response.headers["Content-Type"] = "application/ld+json"
        return response

    requests.adapters.HTTPAdapter.send = answer  # type: ignore[method-assign, assignment]
    settings = services.ValidationSettings(
        rocrate_uri=folder,
        profile_identifier="process-run-crate-0.5",
        requirement_severity=models.Severity[severity],
        no_cache=True,
    )
    issues = defaultdict(set)
    for issue in services.validate(settings).get_issues():
        entity = str(issue.violatingEntity).removeprefix("./#").partition("-0.")[0]
        issues[str(issue.message)].add(entity)
    return {message: sorted(entities) for message, entities in issues.items()}


def validate_phylogeny(path: str) -> dict[str, Any]:
    """Return properties of a phylogeny in the ALife standard, and the identifiers of the roots."""
    import pandas as pd
    from phyloframe import legacy

    table = pd.read_csv(path)
    return {
        "is_valid": bool(legacy.alifestd_validate(table)),
        "is_sexual": bool(legacy.alifestd_is_sexual(table)),
        "is_sorted": bool(legacy.alifestd_is_topologically_sorted(table)),
        "is_chronological": bool(legacy.alifestd_is_chronologically_ordered(table)),
        "roots": legacy.alifestd_find_root_ids(table).tolist(),
    }


if __name__ == "__main__":
    kinds: dict[str, Callable[..., object]]
    kinds = {"crate": validate_crate, "phylogeny": validate_phylogeny}
    print(json.dumps(kinds[sys.argv[1]](*sys.argv[2:])))
