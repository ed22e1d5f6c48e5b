"""Test that compiled code is identified by the code that it can contain, and by nothing else."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.engine import fingerprint
from baldwinlab.engine.jit import cached_jit
from baldwinlab.experiment import Experiment, registry
from baldwinlab.models.miniworld.allocation import list_hooks, make_state
from baldwinlab.models.miniworld.step import simulate_simultaneous
from tests.engine.processes import run_python
from tests.worlds import make_small_experiment

SOURCE = '''"""Module."""

import numpy as np  # arrays
from baldwinlab.engine.rng import philox
from baldwinlab.parts import networks

# The size.
SIZE = (
    3,  # rows

    4,
)
"""Rows and columns."""


def scale(value: float, name: str) -> str:
    """Return a text."""
    text = """
    # no comment

    """

    return f"""{name} # {value * 2!r:>{SIZE[0]}}
    """ + text
'''


def hash_source(text: str) -> str:
    return fingerprint.parse_source("example", text.encode()).code


def test_comments_docstrings_and_blank_lines_are_no_code() -> None:
    changed = SOURCE.replace("Return a text", "Return another text,\n\n    or none")
    changed = changed.replace("# The size.", "# The size of the\n# table.").replace("  # rows", "")
    changed = changed.replace('"""Module."""', '"""Another module."""\n').replace(
        "\n\n    4", "\n    4"
    )
    changed = changed.replace('"""Rows and columns."""\n', "").replace("  # arrays", "")
    assert changed != SOURCE
    assert hash_source(changed) == hash_source(SOURCE)
    assert hash_source(SOURCE.replace("\n", "\r\n")) == hash_source(SOURCE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("value * 2", "value + 2"),
        ("    3,", "    30,"),
        ("# no comment", "# text"),
        ("# no comment\n\n", "# no comment\n"),
        ("} # {", "} # , {"),
    ],
)
def test_a_change_of_code_changes_the_hash(old: str, new: str) -> None:
    assert SOURCE.count(old) == 1
    assert hash_source(SOURCE.replace(old, new)) != hash_source(SOURCE)


def test_a_hash_is_the_same_for_all_versions_of_python() -> None:
    assert hash_source(SOURCE) == "70e0759a302ce013"


def test_the_imports_are_modules_with_compiled_code_and_their_packages() -> None:
    assert fingerprint.parse_source("example", SOURCE.encode()).imports == (
        "baldwinlab.engine",
        "baldwinlab.engine.rng",
        "baldwinlab.parts",
        "baldwinlab.parts.networks",
    )


def list_functions(experiment: Experiment) -> tuple[Any, ...]:
    return (simulate_simultaneous, *list_hooks(make_state(experiment, 1)))


def list_compiled_modules(experiment: Experiment) -> set[str]:
    return {*fingerprint.read_sources(fingerprint.list_modules(list_functions(experiment)))}


def test_an_entry_point_depends_on_its_parts_and_on_no_other_parts() -> None:
    learning = "baldwinlab.models.miniworld.learning"
    settings = {"world": {"features": ["drifting-food"]}, "senses": {"kinds": ["food", "smell"]}}
    hebb = list_compiled_modules(
        make_small_experiment("evo", learning={"rule": "hebb"}, **settings)
    )
    evo = list_compiled_modules(make_small_experiment("evo"))
    assert {f"{learning}.hebbian", f"{learning}.control", "baldwinlab.parts.learning_rules"} <= hebb
    assert "baldwinlab.models.miniworld.senses.real_valued" in hebb
    assert "baldwinlab.models.miniworld.features.food" in hebb
    assert {"baldwinlab.engine.simd", "baldwinlab.models.miniworld.state"} <= evo
    assert not {f"{learning}.{name}" for name in ("hebbian", "abcd", "imitation")} & evo
    assert not {name for name in hebb | evo if name.startswith("baldwinlab.models.nk")}


def test_a_part_within_a_part_is_in_the_modules() -> None:
    features = {"features": ["births-and-deaths"]}
    assert "baldwinlab.evolution.variation_operators" in fingerprint.list_modules(
        list_functions(make_small_experiment("evo", world=features))
    )


def test_the_followed_imports_contain_all_modules_that_python_loads() -> None:
    module = "baldwinlab.models.miniworld.backends.cpu"
    done = run_python(f"import sys, {module}; print(*sys.modules)")
    loaded = {name for name in done.stdout.split() if fingerprint.find_module(name)}
    assert module in loaded
    assert loaded <= {*fingerprint.read_sources([module])}


def test_functions_of_the_package_have_different_names() -> None:
    """Bitcode identifies functions by file and name, because lines depend on comments."""
    positions = defaultdict(set)
    for kind in registry.BUILT_IN:
        for name in registry.package_parts(kind):
            part = registry.find_class(kind, name)
            hooks = part.hooks() if hasattr(part, "hooks") else ()
            for function in fingerprint.reach((cached_jit, *hooks)):
                if hasattr(function, "__code__"):
                    code = function.__code__
                    positions[code.co_filename, function.__qualname__].add(code.co_firstlineno)
    assert len(positions) > 100
    assert [name for name, lines in positions.items() if len(lines) > 1] == []


def test_stored_sources_are_those_of_the_bytes_of_a_file(tmp_path: Path) -> None:
    stored = tmp_path / "sources.json"
    names = ["baldwinlab.models.nk_climbers"]
    computed = fingerprint.read_sources(names)
    assert fingerprint.read_sources(names, stored) == computed
    assert "baldwinlab.models.nk_climbers" in stored.read_text()
    assert fingerprint.read_sources(names, stored) == computed
    stored.write_text("no JSON")
    fingerprint._read_known.cache_clear()
    assert fingerprint.read_sources(names, stored) == computed


PLUG_IN = """
import numpy as np
import plug_in_settings

TABLE = np.zeros(3)


def hook(value, factor={default}, *, offset=0):
    return value * factor + plug_in_settings.SPEED + TABLE[1] + offset
"""


def hash_plug_in(
    folder: Path, *, speed: float = 1.0, entry: float = 0.0, default: int = 1
) -> tuple[str, str]:
    """Return both fingerprints of a hook of a plug-in that reads a setting of another module."""
    (folder / "plug_in_settings.py").write_text(f"SPEED = {speed}\n")
    (folder / "plug_in.py").write_text(PLUG_IN.format(default=default))
    script = (
        f"import sys; sys.path.insert(0, {str(folder)!r}); sys.dont_write_bytecode = True\n"
        "import plug_in\n"
        "from baldwinlab.engine import fingerprint\n"
        f"plug_in.TABLE[1] = {entry}\n"
        "print(fingerprint.fingerprint([plug_in.hook]))\n"
        "print(fingerprint.name_fingerprint([plug_in.hook]))\n"
    )
    first, second = run_python(script).stdout.split()
    return first, second


def test_constants_arrays_and_defaults_of_a_plug_in_change_the_fingerprint(tmp_path: Path) -> None:
    hashes = [
        hash_plug_in(tmp_path),
        hash_plug_in(tmp_path, speed=2.0),
        hash_plug_in(tmp_path, entry=5.0),
        hash_plug_in(tmp_path, default=3),
    ]
    assert hashes[0] == hash_plug_in(tmp_path)
    for fingerprints in zip(*hashes, strict=True):
        assert len(set(fingerprints)) == len(hashes)
