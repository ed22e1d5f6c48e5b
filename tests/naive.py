"""Naive implementation of the paper's model in plain Python, for comparison with the engine.

It follows docs/explanation/model.md and shares no code with the engine. It computes in float64,
with math.exp and atan2, and uses the random numbers of Python. A wrong interpretation in the
engine is therefore not repeated here. Section names are those of the paper.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from random import Random

from baldwinlab.experiment import Evolution, Experiment, FoodRegion, World

LEFT = 0
FORWARD = 1
RIGHT = 2

Layers = list[list[list[float]]]
"""Weights [layer][from unit][to unit]. The last row of a layer has the biases, from a unit 1."""

Genome = list[list[float]]
"""The weights of each module, in a list."""


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
"""A function that moves an eaten item to a new position."""

ActNoisily = Callable[[Agent], None]
"""A function for action noise, which replaces some chosen actions by random actions."""


# "The Simulated World of Foods and Agents"


def circular_difference(start: float, end: float, size: float) -> float:
    """Return the shortest signed difference from `start` to `end` on a circle of length `size`."""
    difference = (end - start) % size
    return difference if difference <= size / 2 else difference - size


def displacement(agent: Agent, item: Item, world: World) -> tuple[float, float]:
    """Return the shortest vector from the agent's center to the item's center on the torus."""
    dx = circular_difference(agent.x, item.x, world.width)
    dy = circular_difference(agent.y, item.y, world.height)
    return dx, dy


def bearing(agent: Agent, item: Item, world: World) -> float:
    """Return theta, the clockwise angle from the agent's heading to the item, in degrees."""
    dx, dy = displacement(agent, item, world)
    return (math.degrees(math.atan2(dy, dx)) - agent.heading) % 360


def find_sensor(theta: float, boundaries: str) -> int | None:
    """Return the sensor (0 left, 1 front, 2 right) of an item at the angle theta."""
    if theta < 15 or theta > 345 or (boundaries == "closed" and theta in (15, 345)):
        return 1
    if 15 < theta < 45:
        return 2
    if 315 < theta < 345:
        return 0
    return None


def sense(agent: Agent, items: Sequence[Item], experiment: Experiment) -> list[int]:
    """Return left, front and right: 1 if an item is visible in this direction, else 0."""
    inputs = [0, 0, 0]
    world = experiment.world
    for item in items:
        if math.hypot(*displacement(agent, item, world)) <= experiment.senses.visual_radius:
            sensor = find_sensor(bearing(agent, item, world), experiment.senses.boundaries)
            if sensor is not None:
                inputs[sensor] = 1
    return inputs


def move(agent: Agent, world: World) -> None:
    """Turn left by 9 degrees and move, move at double speed, or turn right and move."""
    turn = {LEFT: -9, FORWARD: 0, RIGHT: 9}[agent.action]
    speed = 2 if agent.action == FORWARD else 1
    agent.heading = (agent.heading + turn) % 360
    agent.x = (agent.x + speed * math.cos(math.radians(agent.heading))) % world.width
    agent.y = (agent.y + speed * math.sin(math.radians(agent.heading))) % world.height


def contact_distance(agent: Agent, item: Item, experiment: Experiment) -> float:
    dx, dy = displacement(agent, item, experiment.world)
    return max(abs(dx), abs(dy)) if experiment.contact.shape == "square" else math.hypot(dx, dy)


def eat(
    agent: Agent,
    items: Sequence[Item],
    new_items: list[Item],
    experiment: Experiment,
    reappear: Reappear,
) -> None:
    """Eat the items that the body touches, except `new_items`, which reappeared in this step."""
    for item in items:
        is_near = contact_distance(agent, item, experiment) < experiment.contact.reach
        if is_near and item not in new_items:
            agent.eaten += 1
            agent.energy += item.region.energy
            reappear(item)
            new_items.append(item)


# "The neural network controller" and "The Self-taught neural architecture"


def make_layers(weights: Sequence[float], sizes: Sequence[int], biases: bool) -> Layers:
    remaining = iter(weights)
    layers = [
        [[float(next(remaining)) for _ in range(size_to)] for _ in range(size_from + biases)]
        for size_from, size_to in pairwise(sizes)
    ]
    assert next(remaining, None) is None, "a weight is left over"
    return layers


def list_weights(layers: Layers) -> list[float]:
    return [weight for layer in layers for row in layer for weight in row]


def activate(layers: Layers, inputs: Sequence[float], biases: bool) -> list[list[float]]:
    """Return the activations of all units by layer, from the sensors to the outputs."""
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
    """Return the action with the largest output, the first of equal ones."""
    return max(range(len(outputs)), key=lambda action: (outputs[action], -action))


def learn(
    layers: Layers, inputs: Sequence[float], target: Sequence[float], rate: float, biases: bool
) -> None:
    """Take one step of backpropagation (half the squared error) toward `target`."""
    activations = activate(layers, inputs, biases)
    slopes = [[value * (1 - value) for value in units] for units in activations]
    errors = [
        (value - goal) * slope
        for value, goal, slope in zip(activations[-1], target, slopes[-1], strict=True)
    ]
    for depth in range(len(layers) - 1, -1, -1):
        layer = layers[depth]
        sources = activations[depth] + [1.0] * biases
        # The errors of the layer below depend on the weights before the step. The bias has none, so
        # `strict=False` drops the last sum.
        sums = [sum(map(operator.mul, row, errors)) for row in layer]
        errors_below = [slope * total for slope, total in zip(slopes[depth], sums, strict=False)]
        for source, row in zip(sources, layer, strict=True):
            for unit, error in enumerate(errors):
                row[unit] -= rate * error * source
        errors = errors_below


def self_teach(time: int, agent: Agent, experiment: Experiment) -> None:
    """Train the action module on the outputs of the reinforcement module, which is fixed."""
    last = experiment.learning.steps
    if agent.reinforcement_module is not None and (last is None or time < last):
        biases = experiment.network.biases
        target = activate(agent.reinforcement_module, agent.inputs, biases)[-1]
        learn(agent.action_module, agent.inputs, target, agent.rate, biases)


# "Simulation 1: Evolution alone" and "Simulation 2: Evolution of Self-taught agents": lifetimes


def step(
    time: int,
    agents: Sequence[Agent],
    items: Sequence[Item],
    experiment: Experiment,
    reappear: Reappear,
    act_noisily: ActNoisily,
) -> None:
    """Simulate a time step of all agents."""
    new_items: list[Item] = []

    def perceive(agent: Agent) -> None:
        agent.inputs = sense(agent, items, experiment)

    def act(agent: Agent) -> None:
        agent.outputs = activate(agent.action_module, agent.inputs, experiment.network.biases)[-1]
        agent.action = choose(agent.outputs)
        act_noisily(agent)
        move(agent, experiment.world)

    def teach(agent: Agent) -> None:
        self_teach(time, agent, experiment)

    def feed(agent: Agent) -> None:
        eat(agent, items, new_items, experiment, reappear)

    activities = [perceive, act, teach, feed]
    # In each time step, another agent is first.
    order = [agents[(time + turn) % len(agents)] for turn in range(len(agents))]
    if experiment.lifetime.update == "sequential":
        for agent in order:
            for activity in activities:
                activity(agent)
    else:
        for activity in activities:
            for agent in order:
                activity(agent)


def make_agent(genome: Genome, x: float, y: float, experiment: Experiment) -> Agent:
    count = experiment.weight_count
    rate = experiment.learning.rate
    modules = [
        make_layers(weights[:count], experiment.layer_sizes, experiment.network.biases)
        for weights in genome
    ]
    if experiment.learning.evolved_rate:
        rate = min(rate * 10 ** genome[0][count], 10)
    return Agent(x, y, modules[0], modules[1] if experiment.learns else None, rate)


def simulate_generation(
    genomes: Sequence[Genome], experiment: Experiment, random: Random
) -> list[Agent]:
    """Simulate the agents of a generation in one world, from birth to death."""
    world = experiment.world

    def reappear(item: Item) -> None:
        item.x = random.uniform(*item.region.x)
        item.y = random.uniform(*item.region.y)

    def draw_birthplace() -> tuple[float, float]:
        distance = world.start.radius * math.sqrt(random.random())
        angle = random.uniform(0, 2 * math.pi)
        x = world.start.x + distance * math.cos(angle)
        y = world.start.y + distance * math.sin(angle)
        return x % world.width, y % world.height

    def act_noisily(agent: Agent) -> None:
        if experiment.motor.noise and random.random() < experiment.motor.noise:
            agent.action = random.choice([LEFT, FORWARD, RIGHT])

    agents = [make_agent(genome, *draw_birthplace(), experiment) for genome in genomes]
    items = [Item(0, 0, region) for region in world.food for _ in range(region.count)]
    for item in items:
        reappear(item)
    if world.start.headings == "random":
        for agent in agents:
            agent.heading = random.randrange(40) * 9
    for time in range(experiment.lifetime.steps):
        step(time, agents, items, experiment, reappear, act_noisily)
    return agents


# "Simulation 1: Evolution alone": selection, crossover, mutation


def select(fitness: Sequence[float], scheme: str, random: Random) -> int:
    """Return the index of a parent."""
    agents = range(len(fitness))
    if scheme == "tournament":
        return max(random.choice(agents), random.choice(agents), key=lambda agent: fitness[agent])
    if scheme == "truncation":
        shuffled = random.sample(agents, len(agents))
        best = sorted(shuffled, key=lambda agent: -fitness[agent])[: max(1, len(agents) // 2)]
        return random.choice(best)
    shares = list(fitness)
    if scheme == "rank":
        shares = [0.5 + sum(rank_points(energy, item) for item in fitness) for energy in fitness]
    return random.choices(agents, shares if any(shares) else None)[0]


def rank_points(energy: float, competitor: float) -> float:
    """Return 1 for a larger energy than the competitor's, else 1/2."""
    return 1.0 if competitor < energy else 0.5


def make_child(
    genomes: Sequence[Genome], fitness: Sequence[float], evolution: Evolution, random: Random
) -> Genome:
    """Return a genome with each weight from one of two parents at random, after mutation."""
    # The order of the parents does not matter, because each weight has the same chance.
    parents = [genomes[select(fitness, evolution.selection, random)] for _ in range(2)]
    crossed = [
        [random.choice(pair) for pair in zip(*modules, strict=True)]
        for modules in zip(*parents, strict=True)
    ]
    mutates_child = random.random() < evolution.mutation_rate

    def mutate(weight: float) -> float:
        mutates = mutates_child
        if evolution.mutation_gate == "weight":
            mutates = random.random() < evolution.mutation_rate
        return weight + random.uniform(-evolution.mutation_size, evolution.mutation_size) * mutates

    return [[mutate(weight) for weight in module] for module in crossed]


def draw_genome(experiment: Experiment, random: Random) -> Genome:
    return [
        [random.gauss(0, 1) for _ in range(experiment.weight_count)] for _ in experiment.modules
    ]


def evolve(experiment: Experiment, random: Random) -> list[list[Agent]]:
    """Simulate a run and return the agents of every generation at death."""

    def draw_genomes() -> list[Genome]:
        return [draw_genome(experiment, random) for _ in range(experiment.population.size)]

    genomes = draw_genomes()
    history = []
    for _ in range(experiment.evolution.generations):
        history.append(simulate_generation(genomes, experiment, random))
        fitness = [agent.energy for agent in history[-1]]
        if experiment.evolution.inheritance == "none":
            genomes = draw_genomes()
        else:
            genomes = [make_child(genomes, fitness, experiment.evolution, random) for _ in genomes]
    return history
