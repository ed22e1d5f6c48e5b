"""What a part declares: fields with limits and meaning, and that what lies beyond the limits is refused."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from annotated_types import Ge, Gt, Le, Lt

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import PATHS, Subject
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.experiment.registry import key_of
from baldwinlab.parts.agent_parts import Part


def fields_are_declared(subject: Subject) -> str:
    for part in subject.parts:
        for name, info in part.model_fields.items():
            if not info.description:
                raise FailsError(f"{part.__name__}.{name} has no description: its meaning and unit")
            if info.annotation in (int, float) and len(_limits(info)) < 2:
                raise FailsError(f"{part.__name__}.{name} has no limits: ge or gt, and le or lt")
    return ""


def limits_are_refused(subject: Subject) -> str:
    count = 0
    for part in subject.parts:
        for name, value in _outside(part):
            path = f"{_table(part)}.{name}"
            try:
                assign(subject.experiment, [f"{path}={value}"])
            except ExperimentError as error:
                if path in str(error):
                    count += 1
                    continue
                raise FailsError(
                    f"{path} = {value} is refused with {str(error)!r}, which does not name it"
                ) from None
            raise FailsError(f"{path} = {value} is beyond its limits and is not refused")
    return f"{count} values" if count else "it has no numbers"


def _limits(info: Any) -> list[Any]:
    return [mark for mark in info.metadata if isinstance(mark, Ge | Gt | Le | Lt)]


def _outside(part: type[Part]) -> Iterator[tuple[str, float]]:
    """Every number of a part, with a value just beyond each of its limits."""
    for name, info in part.model_fields.items():
        if info.annotation not in (int, float):
            continue
        for mark in _limits(info):
            limit: Any = next(
                getattr(mark, each) for each in ("ge", "gt", "le", "lt") if hasattr(mark, each)
            )
            step = 1 if info.annotation is int else max(1e-6, abs(limit) * 1e-6)
            yield (
                name,
                limit - step
                if isinstance(mark, Ge)
                else limit + step
                if isinstance(mark, Le)
                else limit,
            )


def _table(part: type[Part]) -> str:
    """The dotted path of a part's table."""
    if part.kind == "model":
        return key_of(part.name)
    return f"{PATHS[part.kind].rpartition('.')[0]}.{key_of(part.name)}"
