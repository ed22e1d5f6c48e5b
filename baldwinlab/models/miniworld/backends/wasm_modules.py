"""The WebAssembly modules: those of built-in parts ship with the package, any other is compiled when it is asked for."""

from __future__ import annotations

import hashlib
import json
import sys
from base64 import b64decode, b64encode
from collections.abc import Iterable, Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, Final

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.files import write_atomically
from baldwinlab.engine import cache, wasm
from baldwinlab.engine.compile_errors import compile_error
from baldwinlab.engine.fingerprint import fingerprint
from baldwinlab.engine.numba_internals.dispatchers import NumbaError
from baldwinlab.experiment import Experiment, validate
from baldwinlab.experiment.base import added_choices
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.parts.loading import load_text, sources_of

SHIPPED: Final = Path(__file__).parent / "modules"
FINGERPRINTS: Final = (
    SHIPPED / "fingerprints.json"
)  # of what each was made of, by a Python of that version
RULES: Final = ("none", "self-taught", "drift")
HAND_WRITTEN: Final = ("lanes.py", "reference.py", "wasm.py", "numba_internals/lowering.py")
"""Files of the engine that write LLVM code, which no fingerprint of a function contains."""
UPDATES: Final = ("simultaneous", "sequential")


def load_module(experiment: Experiment) -> bytes:
    """What a browser runs of an experiment's lives. Raises RefusedError where it must be linked and there is no linker."""
    kept = _module_path(experiment)
    if kept and kept.is_file():
        return kept.read_bytes()
    wasm.find_linker()  # says so before a minute has passed
    made = compile_modules([experiment])[0]
    if kept:
        write_atomically(kept, made)
    return made


def is_module_available(experiment: Experiment) -> bool:
    """Whether that module is there already."""
    kept = _module_path(experiment)
    return kept is not None and kept.is_file()


def _module_path(experiment: Experiment) -> Path | None:
    """Where a module ships, or is kept once it has been compiled; None where there is no place to keep it."""
    if not any(added_choices(experiment)):
        return SHIPPED / f"{module_name(experiment)}.wasm"
    kept = cache.cache_root()
    return kept and kept / f"{module_hash(experiment)}.wasm"


def module_name(experiment: Experiment) -> str:
    """Of the module of an experiment whose parts are built in."""
    return f"{experiment.learning.rule}-{experiment.lifetime.update}"


def built_in_experiments() -> dict[str, Experiment]:
    """An experiment for each module that ships, by its name."""
    made = [
        Experiment().replace(learning={"rule": rule}, lifetime={"update": update})
        for rule in RULES
        for update in UPDATES
    ]
    return {module_name(experiment): experiment for experiment in made}


def module_hash(experiment: Experiment) -> str:
    """A hash of all that goes into a module; another Python compiles the same to other bytes, so it has another."""
    habitat = ModuleLayout(experiment)
    functions = [function for function, _ in habitat.entries().values()]
    engine = Path(wasm.__file__).parent
    sources = b"".join((engine / name).read_bytes() for name in HAND_WRITTEN)
    code = fingerprint([*functions, *habitat.hooks()])
    return hashlib.sha256(code.encode() + sources).hexdigest()[:16]


def compile_modules(experiments: Iterable[Experiment]) -> list[bytes]:
    """The modules of experiments, made in a process of its own."""
    given = list(experiments)
    order = {
        "parts": [{"text": source.text, "file": source.file} for source in sources_of(given)],
        "experiments": [experiment.to_dict() for experiment in given],
    }
    return [b64decode(one) for one in wasm.compile_in_subprocess(__name__, order)]


def _compile(order: Mapping[str, Any]) -> list[str]:
    for source in order["parts"]:
        load_text(source["text"], Path(source["file"]))
    return [
        b64encode(_module(ModuleLayout(validate(tree)))).decode() for tree in order["experiments"]
    ]


def _module(habitat: ModuleLayout) -> bytes:
    try:
        return wasm.module(habitat.entries())
    except NumbaError as error:
        raise compile_error(error, habitat.hooks()) or error from None


if __name__ == "__main__":
    try:
        with redirect_stdout(sys.stderr):  # whatever a part's file says when it is loaded
            modules = _compile(json.load(sys.stdin))
        json.dump(modules, sys.stdout)
    except BaldwinLabError as error:
        sys.exit(str(error))
