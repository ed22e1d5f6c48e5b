"""Check the fields of parts, and the views of models."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from annotated_types import Ge, Gt, Le, Lt

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import CHOICE_PATHS, PartGroup, is_of_miniworld
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.experiment.registry import table_name
from baldwinlab.parts.part import Part, compiled_values
from baldwinlab.parts.views import arrays_of

MUTATION_VALUES: Final[Mapping[str, tuple[Any, Any]]] = {
    "mutation_gate": ("weight", "child"),
    "mutation_rate": (0.1, 0.9),
    "mutation_size": (0.1, 0.9),
}
"""Two values of each setting of mutation."""
RELATIVE_STEP: Final = 1e-6
"""Distance of a tested real number from its limit, relative to the limit and at least to 1."""


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
            else:
                yield name, limit


def _table_path(part: type[Part]) -> str:
    """Return the dotted path of the table of a part."""
    if part.kind == "model":
        return table_name(part.name)
    return f"{CHOICE_PATHS[part.kind].rpartition('.')[0]}.{table_name(part.name)}"


def check_views(group: PartGroup) -> str:
    """Check the views of the first and the last newborn."""
    if is_of_miniworld(group.experiment) or not group.experiment.model_part.views:
        return "it declares none"
    model = group.experiment.model_part
    key = GenerationKey(group.seed, 0, 0)
    genomes = draw_genomes(group.experiment, key)
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
