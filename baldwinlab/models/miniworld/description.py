"""What one sees of a world of foragers, in words: from the experiment, and from what its parts say of themselves."""

from __future__ import annotations

from typing import Any, NamedTuple

from baldwinlab.evolution import elders_teach
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.appearance import Look, look


class Topic(NamedTuple):
    title: str
    text: str


def about(experiment: Experiment) -> tuple[Topic, ...]:
    """The map, what agents sense and do, how they learn, and what is worth a look."""
    seen = look(experiment)
    return (
        Topic("The map", _map(experiment, seen)),
        Topic("Senses", _senses(experiment, seen)),
        Topic("Network", _network(experiment, seen)),
        Topic("Learning", _learning(experiment, seen)),
        Topic("What to look for", _what_to_look_for(experiment)),
    )


def _map(experiment: Experiment, seen: Look) -> str:
    counts: dict[str, int] = {}
    for kind in seen.item_kinds:
        counts[kind.name] = counts.get(kind.name, 0) + kind.number
    lying = " and ".join(f"{number:,} items of {name}" for name, number in counts.items())
    return _joined(
        f"{experiment.population.size:,} agents are born in the dashed circle and live {experiment.lifetime.steps:,} steps.",
        f"In the tinted regions lie {lying}; what is eaten lies elsewhere in its region at once."
        if lying
        else "",
        *(_words(feature) for feature in experiment.parts("world.features")),
        "Who leaves the map on one side comes back on the other.",
    )


def _senses(experiment: Experiment, seen: Look) -> str:
    radius = experiment.senses.visual_radius
    sees = f"The pale disc is what an agent sees, {radius:g} units far; a sector lights up while its sensor fires"
    sees += ", the brighter, the more." if experiment.real_valued else "."
    looks = any(sector is not None for sector in seen.sectors)
    return _joined(
        *(_words(sense) for sense in experiment.parts("senses.kinds")), sees if looks else ""
    )


def _network(experiment: Experiment, seen: Look) -> str:
    return _joined(
        f"An agent's network goes from {len(seen.inputs)} sensors to {len(seen.actions)} actions: {', '.join(seen.actions)}.",
        "The largest output is what it does." if experiment.part("motor.body").chooses else "",
        _words(experiment.part("network.kind")),
        _words(experiment.part("motor.body")),
    )


def _learning(experiment: Experiment, seen: Look) -> str:
    modules = (
        f"A genome holds {len(seen.modules)} networks: the {'; the '.join(seen.modules)}."
        if len(seen.modules) > 1
        else ""
    )
    elders = _words(experiment.part("evolution.inheritance")) if elders_teach(experiment) else ""
    return _joined(
        "What happens in life:", _words(experiment.part("learning.rule")), modules, elders
    )


def _what_to_look_for(experiment: Experiment) -> str:
    other = "one that does not learn" if experiment.learns else "one that learns"
    return _joined(
        "Filled agents have eaten, and the bars under the map show when. Do they find what they eat, and stay there?",
        f"Compare an early generation with a late one, or this condition with {other}.",
    )


def _words(part: Any) -> str:
    """The first sentences of what a part says of itself."""
    return " ".join((type(part).__doc__ or "").split("\n\n")[0].split())


def _joined(*sentences: str) -> str:
    return " ".join(sentence for sentence in sentences if sentence)
