"""The lives of a check in a process of their own: a request as JSON in, the bits of runs 0 and 1 as JSON out."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from typing import Any


def answer(request: dict[str, Any]) -> dict[str, Any]:
    from baldwinlab.check.lives import backend_of, lived
    from baldwinlab.experiment import validate
    from baldwinlab.parts.foreign import load_file

    for file in request["files"]:
        load_file(file)
    for module in request["imports"]:
        import_module(module)
    try:
        backend = backend_of(request["backend"])
    except ValueError as error:
        return {"problem": str(error)}
    return {"bits": [lived(validate(each), request["seed"], range(2), backend=backend) for each in request["experiments"]]}


if __name__ == "__main__":
    print(json.dumps(answer(json.load(sys.stdin))))
