"""Compare the compiled hooks of parts with their oracles, step by step in small random worlds."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from copy import deepcopy
from functools import partial
from typing import Any, Final

import numpy as np

from baldwinlab.api.checks.declarations import oracle_key, require_signature, verified_hooks
from baldwinlab.api.checks.evolution import BREEDING_COMPARISONS
from baldwinlab.api.checks.findings import FailsError, NotCheckedError, locate_error
from baldwinlab.api.checks.fixture import PartGroup, part_label, part_values
from baldwinlab.api.checks.oracle_steps import make_naive, record_steps
from baldwinlab.api.checks.reference import Agent
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.parts.part import overridden_hooks
from baldwinlab.parts.senses import find_first_input
from baldwinlab.parts.world_features import LineOfSight

TOLERANCE: Final = 1e-5
"""Tolerance of float32 relative to float64, for weights and outputs of about 1."""
POSITION_TOLERANCE: Final = 1e-3
"""Tolerance of positions, in units of length."""
N_POSITIONS: Final = 2000
"""Number of positions at which a world feature is compared."""
MARGIN: Final = 40.0
"""Distance around the shapes of world features, in units of length."""


def check_oracle(group: PartGroup) -> str:
    """Compare each part with its oracle."""
    remarks = []
    for part in group.parts:
        if not (hooks := verified_hooks(part)):
            continue
        require_signature(part)
        label = f"{part_label(part)}: {', '.join(hooks)}"
        try:
            remark = COMPARISONS[oracle_key(part)](group, part)
        except FailsError as error:
            raise FailsError(f"{label}: {error}") from None
        # An oracle can raise any exception.
        except Exception as error:
            message = f"{part_label(part)}: its oracle fails: {locate_error(error)}"
            raise FailsError(message) from None
        remarks.append(f"{label}, {remark}" if remark else label)
    if not remarks:
        raise NotCheckedError("no hook has an oracle")
    return "; ".join(remarks)


def _require_close(
    actual: Sequence[float], expected: Sequence[float], label: str, tolerance: float = TOLERANCE
) -> None:
    pairs = list(zip(actual, expected, strict=True))
    if not pairs:
        return
    worst_index = max(range(len(pairs)), key=lambda index: abs(pairs[index][0] - pairs[index][1]))
    value, oracle_value = pairs[worst_index]
    # NaN is not close to any number.
    if not abs(value - oracle_value) <= tolerance * (1 + abs(oracle_value)):
        raise FailsError(
            f"{label} {worst_index} is {value:.7g}, and by the oracle {oracle_value:.7g}"
        )


def _compare_rule(group: PartGroup, part: Any) -> str:
    experiment = group.experiment
    has_learned = False
    naive = make_naive(experiment, group.seed)
    values = part_values(experiment, part)
    for step in record_steps(group, part):
        for number in step.survivors:
            agents = deepcopy(step.learning)
            part.oracle(values, agents, agents[number], naive)
            step.learning[number].arrays = agents[number].arrays
            expected = naive.weights(agents[number].action_module)
            has_learned |= expected != naive.weights(step.learning[number].action_module)
            label = f"after step {step.number}, agent {number}: weight"
            _require_close(step.weights[number].tolist(), expected, label)
    return "" if has_learned else "but no agent learned"


def _compare_network(group: PartGroup, part: Any) -> None:
    naive = make_naive(group.experiment)
    values = part_values(group.experiment, part)
    for step in record_steps(group, part):
        for agent_index in step.survivors:
            agent = step.learning[agent_index]
            label = f"in step {step.number}, agent {agent_index}: output"
            _require_close(agent.outputs, part.oracle(values, agent, naive), label)


def _compare_body(group: PartGroup, part: Any) -> None:
    naive = make_naive(group.experiment)
    values = part_values(group.experiment, part)
    for step in record_steps(group, part):
        for agent_index in step.survivors:
            agent = step.sensing[agent_index]
            after = step.learning[agent_index]
            part.oracle(values, agent, naive)
            dx, dy = naive.displacement(agent, after)
            turn = math.remainder(agent.heading - after.heading, 360)
            errors = [dx, dy, turn, agent.action - after.action]
            label = f"after step {step.number}, agent {agent_index}: error (x, y, heading, action)"
            _require_close(errors, [0, 0, 0, 0], label, POSITION_TOLERANCE)


def _compare_sense(group: PartGroup, part: Any) -> None:
    senses = group.experiment.parts("senses.kinds")
    index = [type(sense) for sense in senses].index(part)
    first_input = find_first_input(senses[index], group.experiment)
    naive = make_naive(group.experiment)
    values = part_values(group.experiment, part)
    are_same = _are_close if part.is_continuous else _are_alike
    for step in record_steps(group, part):
        for agent_index in step.survivors:
            agent = step.sensing[agent_index]
            inputs = agent.inputs[first_input : first_input + len(senses[index].inputs)]
            label = f"in step {step.number}, agent {agent_index}: inputs"
            if not all(map(math.isfinite, inputs)):
                raise FailsError(f"{label} are {inputs}: each must be a finite number")

            def inputs_at(
                dx: float, dy: float, agent: Agent = agent, items: Any = step.items
            ) -> Any:
                return part.oracle(values, _move(agent, dx, dy), items, naive)

            _require_same(inputs_at, inputs, label, are_same)
            copy = deepcopy(agent)
            part.oracle(values, copy, step.items, naive)
            step.learning[agent_index].arrays = copy.arrays


def _move(agent: Agent, dx: float, dy: float) -> Agent:
    copy = deepcopy(agent)
    copy.x = agent.x + dx
    copy.y = agent.y + dy
    return copy


def _are_alike(expected: Sequence[Any], actual: Sequence[Any]) -> bool:
    """Return whether binary inputs are equal."""
    return list(map(bool, expected)) == list(map(bool, actual))


def _are_close(expected: Sequence[float], actual: Sequence[float]) -> bool:
    pairs = zip(expected, actual, strict=True)
    return all(abs(oracle_value - value) <= POSITION_TOLERANCE for oracle_value, value in pairs)


def _require_same(
    oracle: Callable[[float, float], Any],
    actual: Any,
    label: str,
    are_same: Callable[[Any, Any], bool] = operator.eq,
) -> None:
    """Require the result of the oracle at a position, or next to it along an axis.

    At an edge, rounding may put a position on either side.
    """
    nudges = (
        (0.0, 0.0),
        (POSITION_TOLERANCE, 0.0),
        (-POSITION_TOLERANCE, 0.0),
        (0.0, POSITION_TOLERANCE),
        (0.0, -POSITION_TOLERANCE),
    )
    if not any(are_same(oracle(*nudge), actual) for nudge in nudges):
        raise FailsError(f"{label} are {actual}, and by the oracle {oracle(0.0, 0.0)}")


def _compare_feature(group: PartGroup, part: Any) -> str:
    """Compare the hooks of a world feature at random positions.

    The oracle gets a position and a displacement, and returns the result of each overridden hook,
    for example {"blocks_movement": True}.
    """
    experiment = group.experiment
    random = np.random.default_rng(group.seed)
    values = part_values(experiment, part)
    hooks = [
        name
        for name in overridden_hooks(part)
        if name in ("blocks_placement", "blocks_sight", "blocks_movement")
    ]
    model = CpuBatch(experiment, group.seed, [0]).model
    low, high = _bounding_box(experiment)
    starts = random.uniform(low, high, (N_POSITIONS, 2))
    displacements = random.uniform(-MARGIN, MARGIN, (N_POSITIONS, 2))
    has_effect = False
    for row in np.column_stack([starts, displacements]).tolist():
        line = LineOfSight(*map(np.float32, row))
        results = {}
        for name in hooks:
            arguments = (line,) if name == "blocks_sight" else (line.x, line.y)
            with np.errstate(all="ignore"):
                results[name] = bool(getattr(part, name)(values, model, *arguments))
        has_effect |= any(results.values())
        x, y, dx, dy = row
        label = f"at ({x:g}, {y:g}), with the displacement ({dx:g}, {dy:g}): results"
        _require_same(partial(_call_feature_oracle, part, values, line), results, label)
    return "" if has_effect else "but it has no effect"


def _call_feature_oracle(
    part: Any, values: Any, line: LineOfSight, nudge_x: float, nudge_y: float
) -> Any:
    x, y, dx, dy = line
    return part.oracle(values, float(x + nudge_x), float(y + nudge_y), float(dx), float(dy))


def _bounding_box(experiment: Any) -> tuple[list[float], list[float]]:
    """Return the corners of a box around the shapes of the features, or of the map."""
    features = experiment.parts("world.features")
    shapes = [shape for feature in features for shape in feature.map_shapes()]
    if not shapes:
        return [0.0, 0.0], [experiment.world.width, experiment.world.height]
    low = [min(shape[axis][0] for shape in shapes) - MARGIN for axis in ("x", "y")]
    return low, [max(shape[axis][1] for shape in shapes) + MARGIN for axis in ("x", "y")]


COMPARISONS: Final[dict[str, Callable[[PartGroup, Any], str | None]]] = {
    "learning rule": _compare_rule,
    "network": _compare_network,
    "body": _compare_body,
    "sense": _compare_sense,
    "world feature": _compare_feature,
    **BREEDING_COMPARISONS,
}
"""The comparisons by key of `declarations.ORACLES`. They return a remark."""
