"""WebAssembly modules for browsers: shipped for common experiments, or compiled on demand."""

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
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.engine import cache, wasm
from baldwinlab.engine.compile_errors import compile_error
from baldwinlab.engine.fingerprint import fingerprint, parse_source
from baldwinlab.engine.numba_internals.dispatchers import NumbaError
from baldwinlab.experiment import Experiment, validate
from baldwinlab.experiment.added_parts import added_choices
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.parts.loading import load_text, sources_of

MODULES_FOLDER: Final = Path(__file__).parent / "modules"
# File with the hashes (`module_hash`) of the shipped modules, for one version of Python.
FINGERPRINTS: Final = MODULES_FOLDER / "fingerprints.json"
RULES: Final = (("none", "none"), ("self-taught", "none"), ("self-taught", "drift"))
"""Pairs of learning rule and control of learning, each of which has shipped modules."""
HAND_WRITTEN: Final = ("simd.py", "reference.py", "wasm.py", "numba_internals/lowering.py")
"""Files of the engine that write LLVM code. Fingerprints of functions do not contain this code."""
UPDATES: Final = ("simultaneous", "sequential")
MAP_FEATURES: Final = ("walls", "patches")
"""World features of the modules for maps that a reader of a page draws."""


def load_module(experiment: Experiment) -> bytes:
    """Return the module of an experiment. Compile the module if necessary.

    Raises `RefusedError` if the module must be linked, and no linker is installed.
    """
    path = _module_path(experiment)
    if path and path.is_file():
        return path.read_bytes()
    # Raise before the compilation, which takes a minute.
    wasm.find_linker()
    module = compile_modules([experiment])[0]
    if path:
        write_atomically(path, module)
    return module


def is_module_available(experiment: Experiment) -> bool:
    """Return whether the module of an experiment is already compiled."""
    path = _module_path(experiment)
    return path is not None and path.is_file()


def _module_path(experiment: Experiment) -> Path | None:
    """Return the path of a shipped or cached module, or None if there is no cache."""
    name = module_name(experiment)
    shipped = shipped_experiments().get(name)
    # The name does not contain all parts, so the added parts must be equal, too.
    if shipped and set(added_choices(shipped)) == set(added_choices(experiment)):
        return MODULES_FOLDER / f"{name}.wasm"
    path = cache.cache_root()
    sources = cache.hash_sources(_list_functions(ModuleLayout(experiment)))
    return path and path / f"{module_hash(experiment)}-{sources}.wasm"


def module_name(experiment: Experiment) -> str:
    """Return the name of a module by learning and update, such as "self-taught-sequential"."""
    learning = experiment.learning
    control = "" if learning.control == "none" else f"-{learning.control}"
    return f"{learning.rule}{control}-{experiment.lifetime.update}"


def built_in_experiments() -> dict[str, Experiment]:
    """Return an experiment for each module that ships, by name."""
    experiments = [
        Experiment().replace(
            learning={"rule": rule, "control": control}, lifetime={"update": update}
        )
        for rule, control in RULES
        for update in UPDATES
    ]
    return {module_name(experiment): experiment for experiment in experiments}


def shipped_experiments() -> dict[str, Experiment]:
    """Return an experiment for each module in the package, by name.

    The modules that are not in `built_in_experiments` are for the explorable and the lesson pack.
    """
    random_targets = Experiment().replace(learning={"rule": "random-targets"})
    maps = {
        f"{rule}-{'-'.join(MAP_FEATURES)}": Experiment().replace(
            learning={"rule": rule}, world={"features": MAP_FEATURES}
        )
        for rule in ("none", "self-taught")
    }
    return built_in_experiments() | {module_name(random_targets): random_targets, **maps}


def module_hash(experiment: Experiment) -> str:
    """Return a hash of the code of a module, which differs between versions of Python."""
    code = fingerprint(_list_functions(ModuleLayout(experiment)))
    engine = Path(wasm.__file__).parent
    sources = [parse_source(name, (engine / name).read_bytes()).code for name in HAND_WRITTEN]
    return hashlib.sha256("\n".join([code, *sources]).encode()).hexdigest()[:16]


def _list_functions(layout: ModuleLayout) -> cache.Functions:
    """Return the entry points of a module, and the hooks of all parts."""
    return (*(function for function, _ in layout.entries().values()), *layout.hooks())


def compile_modules(experiments: Iterable[Experiment]) -> list[bytes]:
    """Return the modules of experiments. A separate process runs this file to compile them."""
    given = list(experiments)
    request = {
        "parts": [{"text": source.text, "file": source.file} for source in sources_of(given)],
        "experiments": [experiment.to_dict() for experiment in given],
    }
    return [b64decode(text) for text in wasm.compile_in_subprocess(__name__, request)]


def _compile(request: Mapping[str, Any]) -> list[str]:
    """Compile the modules of a request of `compile_modules`, and return base64 texts."""
    for source in request["parts"]:
        load_text(source["text"], Path(source["file"]))
    return [
        b64encode(_module(ModuleLayout(validate(tree)))).decode() for tree in request["experiments"]
    ]


def _module(layout: ModuleLayout) -> bytes:
    """Compile a module."""
    try:
        return wasm.module(layout.entries())
    except NumbaError as error:
        raise compile_error(error, layout.hooks()) or error from None


if __name__ == "__main__":
    try:
        # A part can print when it is loaded. The standard output must contain only the modules.
        with redirect_stdout(sys.stderr):
            modules = _compile(json.load(sys.stdin))
        json.dump(modules, sys.stdout)
    except BaldwinLabError as error:
        sys.exit(str(error))
