"""A part's oracle, in plain Python, against its compiled hooks, step by step on random small worlds."""

from __future__ import annotations

import math
import operator
import traceback
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.api.checks.evolution import compare_breeding
from baldwinlab.api.checks.findings import FailsError, NotCheckedError
from baldwinlab.api.checks.fixture import BREEDS, Subject, label, values_of
from baldwinlab.api.checks.reference import Agent, Item, Naive
from baldwinlab.api.checks.signatures import require_signature, verified_hooks
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.models.miniworld.allocation import item_kinds, item_regions
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.state import HEADING_COUNT
from baldwinlab.parts.part import overridden_hooks

CLOSE: Final = 1e-5  # float32 against float64, of weights and outputs of about 1
NEAR: Final = 1e-3  # and of places, units of length
PLACES: Final = 2000  # at which a feature is asked


class Step(NamedTuple):
    """A step of a life: the agents as they sensed, as they learned, and what they came to; the items as they were sensed."""

    number: int
    sensing: list[Agent]
    learning: list[Agent]
    weights: npt.NDArray[np.float32]  # [agent, weight], after the step
    items: list[Item]


def check_oracle(subject: Subject) -> str:
    """Compare each part with its oracle, and return the names of the compared hooks.

    Raises NotCheckedError if no part has an oracle.

    Parameters
    ----------
    subject
        The parts to check.
    """
    remarks = []
    for part in subject.parts:
        if not (hooks := verified_hooks(part)):
            continue
        require_signature(part)
        compare = _compare_breeding if part.kind in BREEDS else COMPARISONS[part.kind]
        named = f"{label(part)}: {', '.join(hooks)}"
        try:
            remark = compare(subject, part)
        except FailsError as error:
            raise FailsError(f"{named}: {error}") from None
        except Exception as error:  # whatever an oracle raises
            place = traceback.extract_tb(error.__traceback__)[-1]
            where = f"{place.filename}:{place.lineno}"
            raise FailsError(
                f"{label(part)}: its oracle fails: {type(error).__name__}: {error} ({where})"
            ) from None
        remarks.append(f"{named}, {remark}" if remark else named)
    if not remarks:
        raise NotCheckedError("no hook has an oracle")
    return "; ".join(remarks)


def naive_of(experiment: Any, seed: int = 0) -> Naive:
    world = experiment.world
    sizes, biases, radius = (
        experiment.layer_sizes,
        experiment.network.biases,
        experiment.senses.visual_radius,
    )
    return Naive(
        sizes, biases, world.width, world.height, radius, seed, tuple(item_kinds(experiment))
    )


def steps_of(subject: Subject, part: Any) -> Iterator[Step]:
    """Yield the steps of a lifetime for oracles. Agents start with the arrays of `part`.

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part.
    """
    experiment, seed = subject.experiment, subject.seed
    naive, batch = naive_of(experiment), CpuBatch(experiment, seed, [0])
    genome = draw_genomes(experiment, GenerationKey(seed, 0, 0))
    batch.begin(0, genome[None])
    agents, values = range(experiment.population.size), values_of(experiment, part, batch.state)
    arrays = {
        name: getattr(values, name) for name, array in part.arrays.items() if array.owner == "agent"
    }
    own: list[dict[str, Any]] = [
        {name: array[:, agent].tolist() for name, array in arrays.items()} for agent in agents
    ]
    for number in range(experiment.lifetime.steps):
        before = _seen(experiment, batch)
        batch.simulate(number, number + 1)
        after = _seen(experiment, batch)
        items = before.pop("items")
        after.pop("items")
        sensing: list[Agent] = []
        learning: list[Agent] = []
        for agent in agents:
            teacher = (
                naive.module(genome[agent, 1]) if "reinforcement" in experiment.modules else None
            )
            modules: dict[str, Any] = {
                "action_module": naive.module(before["weights"][agent]),
                "reinforcement_module": teacher,
            }
            of_now = {name: after[name][agent] for name in ("inputs", "outputs")}
            of_before = {
                name: before[name][agent]
                for name in ("hidden", "eaten_in_life", "gained_in_life", "rate")
            }
            for found, when in ((sensing, before), (learning, after)):
                place = {name: when[name][agent] for name in ("x", "y", "heading", "action")}
                others = [
                    Item(when["x"][other], when["y"][other], "agent")
                    for other in agents
                    if other != agent
                ]
                known = {**place, **of_now, **of_before, **deepcopy(modules), "others": others}
                found.append(Agent(**known, number=agent, step=number, own=own[agent]))
        yield Step(number, sensing, learning, np.array(after["weights"], np.float32), items)
        own = [agent.arrays for agent in learning]


def _seen(experiment: Any, batch: CpuBatch) -> dict[str, Any]:
    """The state of a batch of one world as plain lists, an entry an agent."""
    state, agents, sizes = batch.state, experiment.population.size, experiment.layer_sizes
    kinds = [item_kinds(experiment)[kind] for kind in batch.model.region_kind]
    counts = np.diff(batch.model.region_items)
    hidden = sizes[0], sizes[0] + (sizes[1] if len(sizes) > 2 else 0)
    energies = np.array([region.energy for region in item_regions(experiment)])
    found: dict[str, Any] = {
        "x": state.positions[0], "y": state.positions[1], "heading": state.heading[0] * (360 / HEADING_COUNT),
        "action": state.action[0].astype(int), "eaten_in_life": state.eaten_in_life.sum(axis=0), "rate": state.rate[0],
        "inputs": state.activations[: len(experiment.inputs)].T, "outputs": state.activations[-len(experiment.actions) :].T,
        "gained_in_life": energies @ state.eaten_in_life[: len(energies)],
        "hidden": state.activations[hidden[0] : hidden[1]].T, "weights": state.weights.T,
    }  # fmt: skip
    found = {name: array[:agents].tolist() for name, array in found.items()}
    of_item = [kind for kind, count in zip(kinds, counts, strict=True) for _ in range(count)]
    where = zip(state.item_x[0].tolist(), state.item_y[0].tolist(), of_item, strict=True)
    return found | {"items": [Item(*each) for each in where]}


def _require_close(
    found: Sequence[float], expected: Sequence[float], what: str, tolerance: float = CLOSE
) -> None:
    pairs = list(zip(found, expected, strict=True))
    worst = max(range(len(pairs)), key=lambda k: abs(pairs[k][0] - pairs[k][1]), default=0)
    if pairs and not abs(pairs[worst][0] - pairs[worst][1]) <= tolerance * (
        1 + abs(pairs[worst][1])
    ):
        raise FailsError(
            f"{what} {worst} is {pairs[worst][0]:.7g}, and by the oracle {pairs[worst][1]:.7g}"
        )


def _compare_rule(subject: Subject, part: Any) -> str:
    experiment, learned = subject.experiment, False
    naive, values = naive_of(experiment, subject.seed), values_of(experiment, part)
    for step in steps_of(subject, part):
        for number in range(len(step.learning)):
            agents = deepcopy(step.learning)
            part.oracle(values, agents, agents[number], naive)
            step.learning[number].arrays = agents[number].arrays
            expected = naive.weights(agents[number].action_module)
            learned |= expected != naive.weights(step.learning[number].action_module)
            _require_close(
                step.weights[number].tolist(),
                expected,
                f"after step {step.number}, agent {number}: weight",
            )
    return "" if learned else "though nobody learned anything"


def _compare_network(subject: Subject, part: Any) -> str:
    naive, values = naive_of(subject.experiment), values_of(subject.experiment, part)
    for step in steps_of(subject, part):
        for number, agent in enumerate(step.learning):
            expected = part.oracle(values, agent, naive)
            _require_close(
                agent.outputs, expected, f"in step {step.number}, agent {number}: output"
            )
    return ""


def _compare_body(subject: Subject, part: Any) -> str:
    naive, values = naive_of(subject.experiment), values_of(subject.experiment, part)
    for step in steps_of(subject, part):
        for number, (agent, after) in enumerate(zip(step.sensing, step.learning, strict=True)):
            part.oracle(values, agent, naive)
            turned = math.remainder(agent.heading - after.heading, 360)
            found = [*naive.way(agent, after), turned, agent.action - after.action]
            what = f"after step {step.number}, agent {number}: what is wrong with number (of x, y, heading, action)"
            _require_close(found, [0, 0, 0, 0], what, NEAR)
    return ""


def _compare_sense(subject: Subject, part: Any) -> str:
    senses = subject.experiment.parts("senses.kinds")
    first = sum(len(each.inputs) for each in senses[: [type(each) for each in senses].index(part)])
    naive, values = naive_of(subject.experiment), values_of(subject.experiment, part)
    for step in steps_of(subject, part):
        for number, agent in enumerate(step.sensing):
            found, where = (
                agent.inputs[first : first + len(part.inputs)],
                f"in step {step.number}, agent {number}: inputs",
            )
            if not all(0 <= each <= 1 for each in found):
                raise FailsError(f"{where} are {found}: each must be at least 0 and at most 1")
            _require_same(
                lambda x, y, agent=agent, step=step: part.oracle(
                    values, _moved(agent, x, y), step.items, naive
                ),  # type: ignore[misc]
                found,
                where,
                _all_close if part.is_continuous else _all_alike,
            )
            remembering = deepcopy(agent)
            part.oracle(values, remembering, step.items, naive)
            step.learning[number].arrays = remembering.arrays
    return ""


def _moved(agent: Agent, x: float, y: float) -> Agent:
    moved = deepcopy(agent)
    moved.x, moved.y = agent.x + x, agent.y + y
    return moved


def _all_alike(expected: Sequence[Any], found: Sequence[Any]) -> bool:
    return [bool(each) for each in expected] == [bool(each) for each in found]


def _all_close(expected: Sequence[float], found: Sequence[float]) -> bool:
    return all(abs(one - other) <= NEAR for one, other in zip(expected, found, strict=True))


def _require_same(
    oracle: Callable[[float, float], Any],
    found: Any,
    what: str,
    same: Callable[[Any, Any], bool] = operator.eq,
) -> None:
    """What they answer is the same, but on an edge, where it is what it is a little beside it."""
    nudges = ((0.0, 0.0), (NEAR, 0.0), (-NEAR, 0.0), (0.0, NEAR), (0.0, -NEAR))
    if not any(same(oracle(*nudge), found) for nudge in nudges):
        raise FailsError(f"{what} are {found}, and by the oracle {oracle(0.0, 0.0)}")


def _compare_feature(subject: Subject, part: Any) -> str:
    """The oracle answers, of a place and of a way from it, what each of the feature's own hooks does: {"blocks_movement": True}."""
    experiment, random, values = (
        subject.experiment,
        np.random.default_rng(subject.seed),
        values_of(subject.experiment, part),
    )
    hooks = [
        name
        for name in overridden_hooks(part)
        if name in ("blocks_placement", "blocks_sight", "blocks_movement")
    ]
    model = CpuBatch(experiment, subject.seed, [0]).model
    low, high = _around(experiment)
    true = 0
    for x, y, dx, dy in np.column_stack(
        [random.uniform(low, high, (PLACES, 2)), random.uniform(-40, 40, (PLACES, 2))]
    ).tolist():
        place = [np.float32(each) for each in (x, y, dx, dy)]
        with np.errstate(all="ignore"):
            found = {
                name: bool(
                    getattr(part, name)(values, model, *place[: 4 if name == "blocks_sight" else 2])
                )
                for name in hooks
            }
        true += any(found.values())
        _require_same(
            lambda a, b, place=place: part.oracle(
                values, *(float(e) for e in (place[0] + a, place[1] + b, *place[2:]))
            ),  # type: ignore[misc]
            found,
            f"at ({x:g}, {y:g}), and from there to ({dx:g}, {dy:g}) farther: answers",
        )
    return "" if true else "though it is nowhere"


def _around(experiment: Any) -> tuple[list[float], list[float]]:
    """Where something of the features is drawn, and around it; else the map."""
    marks = [
        mark for feature in experiment.parts("world.features") for mark in feature.map_shapes()
    ]
    if not marks:
        return [0.0, 0.0], [experiment.world.width, experiment.world.height]
    low = [min(mark[axis][0] for mark in marks) - 40.0 for axis in ("x", "y")]
    return low, [max(mark[axis][1] for mark in marks) + 40.0 for axis in ("x", "y")]


def _compare_breeding(subject: Subject, part: Any) -> str:
    compare_breeding(subject, part)
    return ""


COMPARISONS: Final[dict[str, Callable[[Subject, Any], str]]] = {
    "learning rule": _compare_rule,
    "network": _compare_network,
    "body": _compare_body,
    "sense": _compare_sense,
    "world feature": _compare_feature,
}
