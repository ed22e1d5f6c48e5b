"""Check the declarations of parts: fields, arguments of oracles, and views of models."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

from annotated_types import Ge, Gt, Le, Lt

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import CHOICE_PATHS, PartGroup, is_of_miniworld, part_label
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.experiment.registry import table_name
from baldwinlab.parts.part import Part, compiled_values, overridden_hooks
from baldwinlab.parts.views import arrays_of

MUTATION_VALUES: Final[Mapping[str, tuple[Any, Any]]] = {
    "mutation_gate": ("weight", "child"),
    "mutation_rate": (0.1, 0.9),
    "mutation_size": (0.1, 0.9),
}
"""Two different values of each setting of mutation, to find out whether a part reads it."""
RELATIVE_STEP: Final = 1e-6
"""Distance of a tested real number from a limit, as a fraction of max(1, |limit|)."""
PACKAGE_PREFIX: Final = "baldwinlab."


def check_declarations(group: PartGroup) -> str:
    """Check that fields have descriptions, numbers have limits, and settings are declared."""
    for part in group.parts:
        if part.kind == "variation":
            _require_declared_settings(group.experiment, part)
        for name, info in part.model_fields.items():
            if not info.description:
                raise FailsError(f"{part.__name__}.{name} has no description: its meaning and unit")
            n_required_limits = 2
            if info.annotation in (int, float) and len(_list_limits(info)) < n_required_limits:
                raise FailsError(f"{part.__name__}.{name} has no limits: ge or gt, and le or lt")
    return ""


def list_read_settings(experiment: Any) -> list[str]:
    """Return the settings of mutation that the hooks of the variation can read."""
    return [
        name
        for name, values in MUTATION_VALUES.items()
        if len({_describe_variation(experiment, name, value) for value in values}) > 1
    ]


def _describe_variation(experiment: Any, setting: str, value: Any) -> str:
    """Return the values that the hooks of the variation read, as text."""
    changed = experiment.replace(evolution={setting: value})
    part = changed.part("evolution.variation")
    # Only settings and derived values are compared, so `None` replaces each array.
    return repr(compiled_values(part, changed, lambda array: None))


def _require_declared_settings(experiment: Any, part: Any) -> None:
    """Raise FailsError if a variation declares other settings of mutation than it reads."""
    declared = sorted(part.reads)
    read_settings = list_read_settings(experiment)
    if declared != read_settings:
        raise FailsError(
            f"{part.__name__}.reads = {declared} must be the settings of mutation that its "
            f"derived values read: {read_settings}"
        )


def check_limits(group: PartGroup) -> str:
    """Check that values beyond the limits of a field are refused."""
    n_refused = 0
    for part in group.parts:
        for name, value in _list_values_beyond_limits(part):
            path = f"{_table_path(part)}.{name}"
            try:
                assign(group.experiment, [f"{path}={value}"])
            except ExperimentError as error:
                if path in str(error):
                    n_refused += 1
                    continue
                raise FailsError(
                    f"{path} = {value} is refused with {str(error)!r}, which does not name it"
                ) from None
            raise FailsError(f"{path} = {value} is beyond its limits and is not refused")
    return f"{n_refused} values" if n_refused else "it has no numbers"


def _list_limits(info: Any) -> list[Any]:
    return [mark for mark in info.metadata if isinstance(mark, Ge | Gt | Le | Lt)]


def _list_values_beyond_limits(part: type[Part]) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a part, with a value just beyond each limit."""
    for name, info in part.model_fields.items():
        if info.annotation not in (int, float):
            continue
        for mark in _list_limits(info):
            bounds = ("ge", "gt", "le", "lt")
            limit: Any = next(getattr(mark, bound) for bound in bounds if hasattr(mark, bound))
            step = 1 if info.annotation is int else RELATIVE_STEP * max(1.0, abs(limit))
            if isinstance(mark, Ge):
                yield name, limit - step
            elif isinstance(mark, Le):
                yield name, limit + step
            # A limit of Gt or Lt is itself not permitted.
            else:
                yield name, limit


def _table_path(part: type[Part]) -> str:
    """Return the dotted path of the table of a part."""
    if part.kind == "model":
        return table_name(part.name)
    return f"{CHOICE_PATHS[part.kind].rpartition('.')[0]}.{table_name(part.name)}"


def check_views(group: PartGroup) -> str:
    """Check that the views of the first and the last newborn are repeatable and change nothing."""
    if is_of_miniworld(group.experiment) or not group.experiment.model_part.views:
        return "it declares none"
    model = group.experiment.model_part
    key = GenerationKey(group.seed, 0, 0)
    (genomes,) = draw_genomes(group.experiment, key.as_run_keys())
    for name, view in model.views.items():
        for agent in (0, len(genomes) - 1):
            copy = genomes.copy()
            try:
                first, second = (
                    arrays_of(view.make_data(model, key, copy, agent)) for _ in range(2)
                )
            except ValueError as error:
                raise FailsError(f"the view {name!r} of agent {agent}: {error}") from None
            if (copy != genomes).any():
                raise FailsError(f"the view {name!r} changes the genomes that it is given")
            if any(first[array].tobytes() != second[array].tobytes() for array in first):
                raise FailsError(f"the view {name!r} of agent {agent} differs when it is repeated")
    return ", ".join(model.views)


class OracleSignature(NamedTuple):
    """The contract of an oracle."""

    arguments: str
    result: str
    verifies: tuple[str, ...]  # Names of the hooks that the oracle verifies.


ORACLES: Final = {
    "learning rule": OracleSignature(
        "part, agents, agent, naive",
        "it changes agent.action_module",
        ("observe_others", "learn", "compute_change", "change_synapse"),
    ),
    "network": OracleSignature("part, agent, naive", "it returns the outputs", ("forward",)),
    "body": OracleSignature("part, agent, naive", "it changes agent", ("choose_action", "move")),
    "sense": OracleSignature(
        "part, agent, items, naive",
        "it returns the inputs",
        ("sense", "measure", "prepare_senses"),
    ),
    "world feature": OracleSignature(
        "part, x, y, dx, dy",
        "it returns a result by hook",
        ("blocks_placement", "blocks_sight", "blocks_movement"),
    ),
    "selection": OracleSignature(
        "part, generation", "it returns two parents of each child", ("select",)
    ),
    "variation": OracleSignature(
        "part, fitter, second, draws, gate", "it returns the child", ("vary",)
    ),
    "variation with genes": OracleSignature(
        "part, fitter, second, draws, gate, genes", "it returns the child", ("vary",)
    ),
    "vary_population": OracleSignature(
        "part, genome, fitness, parents, draws",
        "it returns all children",
        ("vary", "vary_population"),
    ),
    "inheritance": OracleSignature(
        "part, innate_genome, learned",
        "it returns the inherited module (with `assign_teachers`: and the teacher)",
        ("inherit", "assign_teachers"),
    ),
    "fitness": OracleSignature(
        "part, lifetimes", "it returns the fitness of each agent", ("evaluate",)
    ),
    "stop": OracleSignature(
        "part, lifetimes, fitness",
        "it returns whether a run with these generations stops after the last of them",
        ("should_stop",),
    ),
}
"""The contracts by kind of part. Two special cases of variations have their own keys."""


def oracle_key(part: type[Part]) -> str:
    """Return the key of a part in `ORACLES`."""
    if "vary_population" in overridden_hooks(part):
        return "vary_population"
    reads_genes = part.kind == "variation" and len(part.genes) > 0
    return "variation with genes" if reads_genes else part.kind


def require_oracle_signature(group: PartGroup) -> str:
    """Check the signature of the oracle of each part."""
    parts = [part for part in group.parts if hasattr(part, "oracle") and part.kind in ORACLES]
    for part in parts:
        require_signature(part)
    return "" if parts else "it has no oracle"


def require_signature(part: Any) -> None:
    """Raise an error unless the oracle of a part has the arguments of its kind."""
    key = oracle_key(part)
    contract = ORACLES[key]
    has_genes = key.startswith(part.kind) and len(part.genes) > 0
    cause = "genes" if has_genes else f"`{key}`"
    reason = "" if key == part.kind else f", because it has {cause}"
    expected = f"it must be a static method oracle({contract.arguments}){reason}; {contract.result}"
    if not isinstance(inspect.getattr_static(part, "oracle"), staticmethod):
        raise FailsError(f"{part_label(part)}: oracle is not a static method; {expected}")
    signature = inspect.signature(part.oracle)
    try:
        signature.bind(*contract.arguments.split(", "))
    except TypeError:
        message = f"{part_label(part)}: oracle has the arguments {signature}; {expected}"
        raise FailsError(message) from None


def verified_hooks(part: type[Part]) -> list[str]:
    """Return the hooks of a part that its oracle verifies."""
    contract = ORACLES.get(oracle_key(part))
    if contract is None or not hasattr(part, "oracle"):
        return []
    return [hook for hook in overridden_hooks(part) if hook in contract.verifies]


def unverified_hooks(part: type[Part]) -> Iterator[tuple[str, str]]:
    """Yield each hook of a part that no oracle verifies, and the reason."""
    if part.kind == "model":
        yield "simulate", "oracles of models are not supported"
    has_oracle = hasattr(part, "oracle")
    reason = "its oracle does not cover this hook" if has_oracle else "it has no oracle"
    for hook in overridden_hooks(part):
        if hook not in verified_hooks(part) and not _is_built_in_hook(part, hook):
            yield hook, reason


def _is_built_in_hook(part: type[Part], hook: str) -> bool:
    """Return whether a custom part uses a hook of a built-in part without changes."""
    is_custom = not part.__module__.startswith(PACKAGE_PREFIX)
    return is_custom and getattr(part, hook).__module__.startswith(PACKAGE_PREFIX)
