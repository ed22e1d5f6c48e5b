"""Names in the interface of parts that changed after version 0.1, and errors for old names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic.fields import FieldInfo

from baldwinlab.core.errors import PartError

# New name of each old attribute: for all kinds, and by kind.
RENAMED_IN_ALL_KINDS: Final = {"needs": "required_settings"}
RENAMED_BY_KIND: Final[Mapping[str, Mapping[str, str]]] = {
    "sense": {"survey": "prepare_senses", "real": "is_continuous"},
    "body": {"decide": "choose_action"},
    "network": {"graphs": "has_graph_genomes", "memoryless": "is_memoryless"},
    "learning rule": {
        "inherit": "load_genes",
        "hatch": "init_agent",
        "meet": "observe_others",
        "drift_fits": "supports_drift_control",
        "learns_from": "teacher_array",
    },
    "world feature": {
        "build": "init_world",
        "advance": "end_step",
        "forbids": "blocks_placement",
        "hides": "blocks_sight",
        "stops": "blocks_movement",
        "marks": "map_shapes",
        "bears": "allows_births",
    },
    "selection": {
        "pair": "select_with_genomes",
        "keep": "mark_survivors",
        "least": "minimum_fitness",
    },
    "variation": {"vary_all": "vary_population", "found": "init_founders"},
    "inheritance": {
        "pass_on": "inherit",
        "teach": "assign_teachers",
        "afresh": "resamples_genomes",
    },
    "fitness": {},
    "stop": {},
    "model": {
        "graphs": "has_graph_genomes",
        "live": "simulate",
        "weights": "n_weights",
        "without_learner": "without_learning",
        "checked_with": "check_settings",
    },
}
# New name of each old class, function or constant of `baldwinlab.parts`.
RENAMED_CLASSES: Final = {
    "Cells": "GridView",
    "Lives": "LifeResults",
    "Matrix": "MatrixView",
    "OF_AGENT": "PER_AGENT_DIMS",
    "Walk": "PathView",
    "bundle": "simd_block",
}


def refuse_old_names(name: str, bases: Iterable[Any], namespace: Mapping[str, Any]) -> None:
    """Raise an error if a class defines a hook or flag by its name of version 0.1.

    A setting of the part may have an old name.

    Parameters
    ----------
    name : str
        Name of the class.
    bases : iterable of type
        Base classes of the class.
    namespace : Mapping[str, Any]
        Attributes of the class by name.

    Raises
    ------
    PartError
        If an old name is used. The message has the new name.
    """
    kind = next((base.kind for base in bases if getattr(base, "kind", "")), "")
    renamed = {**RENAMED_IN_ALL_KINDS, **RENAMED_BY_KIND.get(kind, {})}
    used = [
        old for old in renamed if old in namespace and not isinstance(namespace[old], FieldInfo)
    ]
    if used:
        pairs = ", ".join(f"{old} was renamed to {renamed[old]}" for old in used)
        raise PartError(f"{pairs}: use the new name in the class {name}")


def missing_name_error(module: str, name: str) -> Exception:
    """Return the error for a name that does not exist in a module, or that was renamed.

    Parameters
    ----------
    module : str
        Name of the module.
    name : str
        The missing name.

    Returns
    -------
    Exception
        ImportError with the new name, or AttributeError.
    """
    if name in RENAMED_CLASSES:
        return ImportError(f"{module}.{name} was renamed to {RENAMED_CLASSES[name]}")
    return AttributeError(f"module {module!r} has no attribute {name!r}")
