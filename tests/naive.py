"""The paper's model in plain Python: one agent after another, one number after another.

This is the oracle of the tests. It follows docs/explanation/model.md and shares no code with the engine.
It computes in float64, with math.exp and atan2, and uses the random numbers of Python.
A wrong interpretation in the engine is therefore not repeated here.
Section names are those of the paper.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from random import Random

from baldwinlab.experiment import Evolution, Experiment, FoodRegion, World

LEFT, FORWARD, RIGHT = 0, 1, 2

Layers = list[list[list[float]]]
"""weight = layers[layer][from][to]; a layer's biases are one more row, as if from a unit that is always 1."""

Genome = list[list[float]]
"""For each module its weights, one after another."""


@dataclass
class Agent:
    x: float
    y: float
    action_module: Layers
    reinforcement_module: Layers | None
    rate: float = 0.0
    heading: float = 0.0
    inputs: list[int] = field(default_factory=list)
    outputs: list[float] = field(default_factory=list)
    action: int = FORWARD
    eaten: int = 0
    energy: float = 0.0


@dataclass(eq=False)
class Item:
    x: float
    y: float
    region: FoodRegion


Reappear = Callable[[Item], None]
"""Gives an eaten item its new place."""

ActNoisily = Callable[[Agent], None]
"""Action noise: now and then puts another action in the place of the one that was chosen."""


# "The Simulated World of Foods and Agents"


def shortest(start: float, end: float, size: float) -> float:
    """The way from `start` to `end` on a circle of length `size`; forwards is positive."""
    forwards = (end - start) % size
    return forwards if forwards <= size / 2 else forwards - size


def way(agent: Agent, item: Item, world: World) -> tuple[float, float]:
    """From the agent's centre to the item's, over the edges of the map where that is nearer."""
    return shortest(agent.x, item.x, world.width), shortest(agent.y, item.y, world.height)


def bearing(agent: Agent, item: Item, world: World) -> float:
    """Theta: where the item is, clockwise from the agent's heading, in degrees from 0 to 360."""
    dx, dy = way(agent, item, world)
    return (math.degrees(math.atan2(dy, dx)) - agent.heading) % 360


def sensor_of(theta: float, boundaries: str) -> int | None:
    """The sensor (0 left, 1 front, 2 right) in which an item at the angle theta falls."""
    if theta < 15 or theta > 345 or (boundaries == "closed" and theta in (15, 345)):
        return 1
    if 15 < theta < 45:
        return 2
    if 315 < theta < 345:
        return 0
    return None


def sense(agent: Agent, items: Sequence[Item], experiment: Experiment) -> list[int]:
    """Left, front and right: 1 if any item is there in the visual range."""
    inputs = [0, 0, 0]
    for item in items:
        if math.hypot(*way(agent, item, experiment.world)) <= experiment.senses.visual_radius:
            sensor = sensor_of(bearing(agent, item, experiment.world), experiment.senses.boundaries)
            if sensor is not None:
                inputs[sensor] = 1
    return inputs


def move(agent: Agent, world: World) -> None:
    """Three basic movements: turn left by 9 degrees and move; move at double speed; turn right by 9 degrees and move."""
    turn = {LEFT: -9, FORWARD: 0, RIGHT: 9}[agent.action]
    speed = 2 if agent.action == FORWARD else 1
    agent.heading = (agent.heading + turn) % 360
    agent.x = (agent.x + speed * math.cos(math.radians(agent.heading))) % world.width
    agent.y = (agent.y + speed * math.sin(math.radians(agent.heading))) % world.height


def distance_of_bodies(agent: Agent, item: Item, experiment: Experiment) -> float:
    dx, dy = way(agent, item, experiment.world)
    return max(abs(dx), abs(dy)) if experiment.contact.shape == "square" else math.hypot(dx, dy)


def eat(
    agent: Agent,
    items: Sequence[Item],
    fresh: list[Item],
    experiment: Experiment,
    reappear: Reappear,
) -> None:
    """Eat what the body touches. What reappeared in this step is `fresh`, and is left for the next."""
    for item in items:
        if (
            item not in fresh
            and distance_of_bodies(agent, item, experiment) < experiment.contact.reach
        ):
            agent.eaten += 1
            agent.energy += item.region.energy
            reappear(item)
            fresh.append(item)


# "The neural network controller" and "The Self-taught neural architecture"


def layers_of(weights: Sequence[float], sizes: Sequence[int], biases: bool) -> Layers:
    remaining = iter(weights)
    layers = [
        [[float(next(remaining)) for _ in range(size_to)] for _ in range(size_from + biases)]
        for size_from, size_to in pairwise(sizes)
    ]
    assert next(remaining, None) is None, "a weight is left over"
    return layers


def weights_of(layers: Layers) -> list[float]:
    return [weight for layer in layers for row in layer for weight in row]


def think(layers: Layers, inputs: Sequence[float], biases: bool) -> list[list[float]]:
    """The activations of all units, layer by layer, from the sensors to the outputs."""
    activations = [[float(value) for value in inputs]]
    for layer in layers:
        sources = activations[-1] + [1.0] * biases
        sums = [
            sum(source * row[unit] for source, row in zip(sources, layer, strict=True))
            for unit in range(len(layer[0]))
        ]
        activations.append([1 / (1 + math.exp(-total)) for total in sums])
    return activations


def choose(outputs: Sequence[float]) -> int:
    """The action with the largest output; of equals, the first."""
    return max(range(len(outputs)), key=lambda action: (outputs[action], -action))


def learn(
    layers: Layers, inputs: Sequence[float], target: Sequence[float], rate: float, biases: bool
) -> None:
    """One step of backpropagation (half the squared error) towards `target`."""
    activations = think(layers, inputs, biases)
    slopes = [[value * (1 - value) for value in units] for units in activations]
    errors = [
        (value - goal) * slope
        for value, goal, slope in zip(activations[-1], target, slopes[-1], strict=True)
    ]
    for depth in range(len(layers) - 1, -1, -1):
        layer, sources = layers[depth], activations[depth] + [1.0] * biases
        # The errors of the units below come from the weights of before the step.
        below = [slope * sum(weight * error for weight, error in zip(row, errors, strict=True))
                 for slope, row in zip(slopes[depth], layer, strict=False)]  # fmt: skip
        for source, row in zip(sources, layer, strict=True):
            for unit, error in enumerate(errors):
                row[unit] -= rate * error * source
        errors = below


def self_teach(time: int, agent: Agent, experiment: Experiment) -> None:
    """The reinforcement module, which is fixed for life, tells the action module what it should have said."""
    stops = experiment.learning.steps
    if agent.reinforcement_module is not None and (stops is None or time < stops):
        biases = experiment.network.biases
        target = think(agent.reinforcement_module, agent.inputs, biases)[-1]
        learn(agent.action_module, agent.inputs, target, agent.rate, biases)


# "Simulation 1: Evolution alone" and "Simulation 2: Evolution of Self-taught agents": a life


def step(
    time: int,
    agents: Sequence[Agent],
    items: Sequence[Item],
    experiment: Experiment,
    reappear: Reappear,
    act_noisily: ActNoisily,
) -> None:
    """One time step of all agents."""
    fresh: list[Item] = []

    def perceive(agent: Agent) -> None:
        agent.inputs = sense(agent, items, experiment)

    def act(agent: Agent) -> None:
        agent.outputs = think(agent.action_module, agent.inputs, experiment.network.biases)[-1]
        agent.action = choose(agent.outputs)
        act_noisily(agent)
        move(agent, experiment.world)

    def teach(agent: Agent) -> None:
        self_teach(time, agent, experiment)

    def feed(agent: Agent) -> None:
        eat(agent, items, fresh, experiment, reappear)

    activities = [perceive, act, teach, feed]
    order = [agents[(time + turn) % len(agents)] for turn in range(len(agents))]
    if experiment.lifetime.update == "sequential":
        for agent in order:
            for activity in activities:
                activity(agent)
    else:
        for activity in activities:
            for agent in order:
                activity(agent)


def born(genome: Genome, x: float, y: float, experiment: Experiment) -> Agent:
    count, rate = experiment.weight_count, experiment.learning.rate
    modules = [
        layers_of(weights[:count], experiment.layer_sizes, experiment.network.biases)
        for weights in genome
    ]
    if experiment.learning.evolved_rate:
        rate = min(rate * 10 ** genome[0][count], 10)
    return Agent(x, y, modules[0], modules[1] if experiment.learns else None, rate)


def live(genomes: Sequence[Genome], experiment: Experiment, random: Random) -> list[Agent]:
    """One generation, from birth to death, in one world."""

    def reappear(item: Item) -> None:
        item.x, item.y = random.uniform(*item.region.x), random.uniform(*item.region.y)

    def birthplace() -> tuple[float, float]:
        world, distance, angle = (
            experiment.world,
            math.sqrt(random.random()),
            random.uniform(0, 2 * math.pi),
        )
        x = world.start.x + world.start.radius * distance * math.cos(angle)
        y = world.start.y + world.start.radius * distance * math.sin(angle)
        return x % world.width, y % world.height

    def act_noisily(agent: Agent) -> None:
        if experiment.motor.noise and random.random() < experiment.motor.noise:
            agent.action = random.choice([LEFT, FORWARD, RIGHT])

    agents = [born(genome, *birthplace(), experiment) for genome in genomes]
    items = [Item(0, 0, region) for region in experiment.world.food for _ in range(region.count)]
    for item in items:
        reappear(item)
    for agent in agents if experiment.world.start.headings == "random" else ():
        agent.heading = random.randrange(40) * 9
    for time in range(experiment.lifetime.steps):
        step(time, agents, items, experiment, reappear, act_noisily)
    return agents


# "Simulation 1: Evolution alone": selection, crossover, mutation


def select(fitness: Sequence[float], scheme: str, random: Random) -> int:
    """One parent."""
    agents = range(len(fitness))
    if scheme == "tournament":
        return max(random.choice(agents), random.choice(agents), key=lambda agent: fitness[agent])
    if scheme == "truncation":
        shuffled = random.sample(agents, len(agents))
        best = sorted(shuffled, key=lambda agent: -fitness[agent])[: max(1, len(agents) // 2)]
        return random.choice(best)
    shares = list(fitness)
    if scheme == "rank":
        shares = [sum(1.0 if other < own else 0.5 for other in fitness) + 0.5 for own in fitness]
    return random.choices(agents, shares if any(shares) else None)[0]


def child(
    genomes: Sequence[Genome], fitness: Sequence[float], evolution: Evolution, random: Random
) -> Genome:
    """Every weight from the fitter of two parents or from the other, then mutation."""
    fitter, other = (
        genomes[select(fitness, evolution.selection, random)] for _ in range(2)
    )  # a coin has no side for the fitter
    copied = [
        [random.choice(pair) for pair in zip(*modules, strict=True)]
        for modules in zip(fitter, other, strict=True)
    ]
    whole_child = random.random() < evolution.mutation_rate

    def mutated(weight: float) -> float:
        opens = (
            random.random() < evolution.mutation_rate
            if evolution.mutation_gate == "weight"
            else whole_child
        )
        return weight + random.uniform(-evolution.mutation_size, evolution.mutation_size) * opens

    return [[mutated(weight) for weight in module] for module in copied]


def evolve(experiment: Experiment, random: Random) -> list[list[Agent]]:
    """A whole run: the agents of every generation, as they died."""

    def fresh() -> list[Genome]:
        return [[[random.gauss(0, 1) for _ in range(experiment.weight_count)] for _ in experiment.modules]
                for _ in range(experiment.population.size)]  # fmt: skip

    genomes, history = fresh(), []
    for _ in range(experiment.evolution.generations):
        history.append(live(genomes, experiment, random))
        fitness = [agent.energy for agent in history[-1]]
        if experiment.evolution.inheritance == "none":
            genomes = fresh()
        else:
            genomes = [child(genomes, fitness, experiment.evolution, random) for _ in genomes]
    return history
