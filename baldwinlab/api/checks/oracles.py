"""Compare compiled hooks with the oracles of the parts, step by step in small random worlds."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.api.checks.declarations import oracle_key, require_signature, verified_hooks
from baldwinlab.api.checks.evolution import BREEDING_COMPARISONS
from baldwinlab.api.checks.findings import FailsError, NotCheckedError
from baldwinlab.api.checks.fixture import PartGroup, part_label, part_values
from baldwinlab.api.checks.reference import Agent, Item, Naive
from baldwinlab.core.third_party_code import run_third_party_code
from baldwinlab.evolution import draw_genomes, make_run_keys
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.regions import item_kinds, item_regions
from baldwinlab.models.miniworld.state import HEADING_COUNT
from baldwinlab.parts.part import overridden_hooks
from baldwinlab.parts.senses import find_first_input
from baldwinlab.parts.world_features import LineOfSight

MOVED_VARIABLES = ("x", "y", "heading", "action")
"""Variables of an agent that a body changes."""
EARLIER_VARIABLES = ("hidden", "eaten_in_life", "gained_in_life", "rate")
"""Variables of an agent. An oracle gets the values before the step."""
TOLERANCE: Final = 1e-5
"""Tolerance of float32 relative to float64, for weights and outputs of about 1."""
POSITION_TOLERANCE: Final = 1e-3
"""Tolerance of positions, in units of length."""
N_POSITIONS: Final = 2000
"""Number of positions at which a world feature is compared."""
MARGIN: Final = 40.0
"""Distance around the shapes of world features, in units of length."""


class Step(NamedTuple):
    """A step of a lifetime."""

    number: int
    sensing: list[Agent]  # The agents at the positions before the step, where they sensed.
    learning: list[Agent]  # The agents with the positions after the step.
    weights: npt.NDArray[np.float32]  # Weights after the step, [agent, weight].
    items: list[Item]
    # Indices of the agents that no newborn replaced at the end of the step. Only for these agents,
    # `sensing`, `learning` and `weights` are about the same individual.
    survivors: list[int]


def make_naive(experiment: Any, seed: int) -> Naive:
    """Return the reference functions for an experiment."""
    world = experiment.world
    return Naive(
        sizes=experiment.layer_sizes,
        biases=experiment.network.biases,
        width=world.width,
        height=world.height,
        visual_radius=experiment.senses.visual_radius,
        seed=seed,
        kinds=tuple(item_kinds(experiment)),
    )


def record_steps(group: PartGroup, part: Any) -> Iterator[Step]:
    """Simulate a lifetime, and yield each step with the arguments of oracles."""
    experiment = group.experiment
    naive = make_naive(experiment, group.seed)
    batch = CpuBatch(experiment, group.seed, [0])
    batch.begin(0, draw_genomes(experiment, make_run_keys(group.seed, [0], 0)))
    agent_arrays = _initial_arrays(experiment, part, batch.state)
    for number in range(experiment.lifetime.steps):
        teachers = _list_teachers(experiment, naive, batch)
        births = batch.state.birth_count[0].copy()
        before = _take_snapshot(experiment, batch)
        items = _list_items(experiment, batch)
        batch.simulate(number, number + 1)
        after = _take_snapshot(experiment, batch)
        sensing: list[Agent] = []
        learning: list[Agent] = []
        for agent, (teacher, arrays) in enumerate(zip(teachers, agent_arrays, strict=True)):
            fixed = {
                "inputs": after["inputs"][agent],
                "outputs": after["outputs"][agent],
                **{name: before[name][agent] for name in EARLIER_VARIABLES},
                "number": agent,
                "step": number,
                "arrays": arrays,
            }
            action_module = naive.module(before["weights"][agent])
            # Each agent gets copies of the modules, because oracles change them.
            for agents, snapshot in ((sensing, before), (learning, after)):
                modules = deepcopy((action_module, teacher))
                agents.append(_make_agent(snapshot, agent, fixed, modules))
        survivors = np.flatnonzero(batch.state.birth_count[0] == births).tolist()
        weights = np.array(after["weights"], np.float32)
        yield Step(number, sensing, learning, weights, items, survivors)
        # A newborn has new arrays. A survivor keeps the arrays that the oracle changed.
        agent_arrays = _initial_arrays(experiment, part, batch.state)
        for agent in survivors:
            agent_arrays[agent] = learning[agent].arrays


def _list_teachers(experiment: Any, naive: Naive, batch: CpuBatch) -> list[Any]:
    """Return the reinforcement module of each agent, or a list of None without such modules."""
    if "reinforcement" not in experiment.modules:
        return [None] * experiment.population.size
    reinforcement = experiment.modules.index("reinforcement")
    return [naive.module(genome[reinforcement]) for genome in batch.state.genome[0]]


def _initial_arrays(experiment: Any, part: Any, state: Any) -> list[dict[str, Any]]:
    """Return the arrays of the part that each agent has, by name: [agent][name][entry]."""
    values = part_values(experiment, part, state)
    names = [name for name, array in part.arrays.items() if array.owner == "agent"]
    return [
        {name: getattr(values, name)[:, agent].tolist() for name in names}
        for agent in range(experiment.population.size)
    ]


def _make_agent(
    snapshot: Mapping[str, Any], agent_index: int, fixed: Mapping[str, Any], modules: Sequence[Any]
) -> Agent:
    positions = enumerate(zip(snapshot["x"], snapshot["y"], strict=True))
    action_module, reinforcement_module = modules
    return Agent(
        **{name: snapshot[name][agent_index] for name in MOVED_VARIABLES},
        **fixed,
        action_module=action_module,
        reinforcement_module=reinforcement_module,
        other_agents=[Item(x, y, "agent") for agent, (x, y) in positions if agent != agent_index],
    )


def _take_snapshot(experiment: Any, batch: CpuBatch) -> dict[str, Any]:
    """Return the state of a batch of one world by name, as lists [agent] or [agent][entry]."""
    state = batch.state
    agents = experiment.population.size
    sizes = experiment.layer_sizes
    # A network without hidden layers has two sizes: inputs and outputs.
    hidden_units = sizes[1] if len(sizes) > 2 else 0
    energies = np.array([region.energy for region in item_regions(experiment)])
    # The counts of the engine include the replaced agents. A newborn has eaten nothing.
    eaten_in_life = state.eaten_in_life - state.eaten_before
    arrays: dict[str, Any] = {
        "x": state.positions[0],
        "y": state.positions[1],
        "heading": state.heading[0] * (360 / HEADING_COUNT),
        "action": state.action[0].astype(int),
        "eaten_in_life": eaten_in_life.sum(axis=0),
        "rate": state.rate[0],
        "inputs": state.activations[: len(experiment.inputs)].T,
        "outputs": state.activations[-len(experiment.actions) :].T,
        "gained_in_life": energies @ eaten_in_life[: len(energies)],
        "hidden": state.activations[sizes[0] : sizes[0] + hidden_units].T,
        "weights": state.weights.T,
    }
    return {name: array[:agents].tolist() for name, array in arrays.items()}


def _list_items(experiment: Any, batch: CpuBatch) -> list[Item]:
    """Return the items of a batch of one world."""
    model = batch.model
    state = batch.state
    names = item_kinds(experiment)
    counts = np.diff(model.region_items)
    kinds = [
        names[kind]
        for kind, count in zip(model.region_kind, counts, strict=True)
        for _ in range(count)
    ]
    world = 0
    items = zip(state.item_x[world].tolist(), state.item_y[world].tolist(), kinds, strict=True)
    return [Item(x, y, kind) for x, y, kind in items]


def check_oracle(group: PartGroup) -> str:
    """Compare each part with its oracle."""
    remarks = []
    for part in group.parts:
        if not (hooks := verified_hooks(part)):
            continue
        require_signature(part)
        label = f"{part_label(part)}: {', '.join(hooks)}"
        try:
            with run_third_party_code(f"{part_label(part)}: its oracle fails"):
                remark = COMPARISONS[oracle_key(part)](group, part)
        except FailsError as error:
            raise FailsError(f"{label}: {error}") from None
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
            # Each call gets new copies, because the oracle changes agents.
            agents = deepcopy(step.learning)
            part.oracle(values, agents, agents[number], naive)
            step.learning[number].arrays = agents[number].arrays
            expected = naive.weights(agents[number].action_module)
            has_learned |= expected != naive.weights(step.learning[number].action_module)
            label = f"after step {step.number}, agent {number}: weight"
            _require_close(step.weights[number].tolist(), expected, label)
    return "" if has_learned else "but no agent learned"


def _compare_network(group: PartGroup, part: Any) -> None:
    naive = make_naive(group.experiment, group.seed)
    values = part_values(group.experiment, part)
    for step in record_steps(group, part):
        for agent_index in step.survivors:
            agent = step.learning[agent_index]
            label = f"in step {step.number}, agent {agent_index}: output"
            _require_close(agent.outputs, part.oracle(values, agent, naive), label)


def _compare_body(group: PartGroup, part: Any) -> None:
    naive = make_naive(group.experiment, group.seed)
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
    naive = make_naive(group.experiment, group.seed)
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
            # `_move` made copies, so one more call stores the arrays for the next step.
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
    """Require that the oracle agrees at the position, or near the position because of rounding."""
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
"""The comparisons by key of `declarations.ORACLES`. Each returns a remark, or None."""
