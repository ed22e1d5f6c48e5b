"""Kinds of part that belong to an agent or to its world, and the hooks of each kind.

A part is a class that derives from one of these kinds and has a name:
`class Social(LearningRule, name="social")`.

- Annotations are settings of the experiment.
- `arrays` declares the arrays of the part.
- Static methods are hooks, compiled by Numba. A part inherits every hook that it does not define.

A hook has the arguments of its kind, with the same names. The first is the part: a NamedTuple of
its numeric settings, its `derived` values and its arrays.

A *per-agent* hook is called for one lane: the column of one agent in arrays [row, lane], or a SIMD
block of 16 such columns. It must not read other agents, and reaches its lane only by `get` and
`put`.

A *per-world* hook may read and write the arrays of all agents of its world: `prepare_senses`,
`observe_others`, `init_world`, `end_step`.

The fields of `model` and `state` are described in `Model` and `State` of
`baldwinlab/models/miniworld/state.py`.
"""

from __future__ import annotations

import inspect
from collections import namedtuple
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from baldwinlab.engine.phases import Array, hook
from baldwinlab.engine.simd import Lane, Mask, Value, choose, get, put
from baldwinlab.experiment import registry
from baldwinlab.experiment.fields import Fields
from baldwinlab.parts.lane_check import require_own_column
from baldwinlab.parts.renamed import refuse_old_names

ZERO, ONE = np.float32(0), np.float32(1)


if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass as FieldsMeta
else:
    FieldsMeta = type(Fields)


class PartMeta(FieldsMeta):
    """Check the names in a part's class before pydantic does."""

    def __new__(mcs, class_name: str, bases: Any, namespace: Any, /, **options: Any) -> Any:
        refuse_old_names(class_name, bases, namespace)
        return super().__new__(mcs, class_name, bases, namespace, **options)


class Part(Fields, metaclass=PartMeta):
    """Base class of all kinds of part.

    The annotations of a part are settings of the experiment: pydantic fields with a description, a
    unit
    and limits. The name of the part chooses it.

    Attributes
    ----------
    kind : str
        Kind of part, such as "sense". Set by the kind.
    name : str
        Name of the part. Set by `class X(Kind, name="x")`.
    arrays : Mapping[str, Array]
        Arrays of the part by name, declared with `per_agent`, `per_lane` or `per_world`. A
        dimension is a
        number, or "weights", "units", "inputs" or "actions".
    derived : Mapping[str, Callable]
        Functions of (part, experiment) by name. Hooks read the results, numbers or arrays, as
        `part.NAME`.
    required_settings : Mapping[str, Any]
        Settings by dotted path that an experiment with the part needs. `baldwinlab check` uses
        them.
    Compiled : type
        NamedTuple class of the first argument of the hooks.
    """

    kind: ClassVar[str] = ""
    name: ClassVar[str] = ""
    arrays: ClassVar[Mapping[str, Array]] = {}
    derived: ClassVar[Mapping[str, Callable[[Any, Any], Any]]] = {}
    required_settings: ClassVar[Mapping[str, Any]] = {}
    Compiled: ClassVar[type]

    def __init_subclass__(cls, name: str = "", **options: Any) -> None:
        super().__init_subclass__(**options)

    @classmethod
    def __pydantic_init_subclass__(cls, name: str = "", **options: Any) -> None:
        super().__pydantic_init_subclass__(**options)
        if not name:
            # A kind, or a base class of parts.
            return
        built_in = registry.is_built_in(cls.kind, name, cls.__module__)
        _require_signatures(cls)
        cls.name = name
        fields = [*numeric_fields(cls), *cls.derived, *cls.arrays]
        made: Any = namedtuple("Compiled", fields)  # type: ignore[misc]
        # Numba's cache finds the class by these names.
        made.__module__ = cls.__module__
        made.__qualname__ = f"{cls.__qualname__}.Compiled"
        # mypy knows the attributes of a NamedTuple, so an assignment would be an error.
        setattr(made, "part", cls)  # noqa: B010
        cls.Compiled = made
        if not built_in:
            require_own_column(
                {each: getattr(cls, each) for each in overridden_hooks(cls)}, cls.arrays
            )
            registry.add(cls.kind, name, cls)

    @classmethod
    def hooks(cls) -> tuple[Callable[..., Any], ...]:
        """Return the functions of all hooks of the part."""
        return tuple(getattr(cls, each) for each in hook_names(cls))

    def check(self, experiment: Any) -> None:
        """Check that the part fits an experiment.

        Raises
        ------
        ValueError
            If the part cannot be used with these settings. The message is shown to the user.
        """


def hook_names(kind: type[Part]) -> list[str]:
    """Return the names of the hooks of a kind."""
    base = next(each for each in kind.__mro__ if Part in each.__bases__)
    return [name for name, value in vars(base).items() if isinstance(value, staticmethod)]


def overridden_hooks(part: type[Part]) -> list[str]:
    """Return the names of the hooks that a part defines itself."""
    return [name for name in hook_names(part) if getattr(part, name) is not _of_kind(part, name)]


def numeric_fields(part: type[Part]) -> list[str]:
    """Return the names of the settings that compiled code can read: int, float and bool."""
    return [
        name for name, info in part.model_fields.items() if info.annotation in (int, float, bool)
    ]


def _require_signatures(part: type[Part]) -> None:
    for name in hook_names(part):
        wanted = [*inspect.signature(_of_kind(part, name)).parameters]
        given = vars(part).get(name)
        if given is not None and not isinstance(given, staticmethod):
            raise TypeError(
                f"{part.__name__}.{name} must be a static method: "
                f"@staticmethod def {name}({', '.join(wanted)})"
            )
        if [*inspect.signature(getattr(part, name)).parameters] != wanted:
            raise TypeError(
                f"{part.__name__}.{name} must have the arguments of its kind: "
                f"{name}({', '.join(wanted)})"
            )


def _of_kind(part: type[Part], name: str) -> Callable[..., Any]:
    base = next(each for each in part.__mro__ if Part in each.__bases__)
    return getattr(base, name)  # type: ignore[no-any-return]


@hook
def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
    """Return the inputs of a binary sense as bits.

    Per agent, once per step, if `is_continuous` is false.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world, agent : int
        Indices of the world and of the agent in it. The lane is `world * model.agents + agent`.

    Returns
    -------
    int
        Bit k is 1 if input k is on. Input 0 is the lowest bit.
    """
    return 0


@hook
def measure(part: Any, model: Any, state: Any, world: int, agent: int, first: int) -> None:
    """Write the inputs of a continuous sense.

    Per agent, once per step, if `is_continuous` is true.
    It writes rows `first`, `first + 1`, ... of `state.activations`, float32 in [0, 1], and nothing
    else
    that is not an array of the part.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world, agent : int
        Indices of the world and of the agent in it. The lane is `world * model.agents + agent`.
    first : int
        Row of the first input of the part in `state.activations`.
    """


@hook
def prepare_senses(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Compute data about other agents before the agents sense.

    Per world, at the beginning of every step. It may write the arrays of the part
    and per-agent arrays of `state`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world : int
        Index of the world.
    step : int
        Step of the lifetime, from 0.
    """


@hook
def choose_action(part: Any, model: Any, state: Any, lane: Lane) -> None:
    """Write the chosen action to `state.action` [1, lane].

    Per agent, once per step, after the network. By default the action is the index of the largest
    output. The first of equal outputs is chosen.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    lane : Lane
        Column of an agent, or a SIMD block.
    """
    rows, actions = state.activations.shape[0], state.targets.shape[0]
    best, action = get(state.activations, rows - actions, lane), ZERO
    put(state.action, 0, lane, action)
    for number in range(1, actions):
        output = get(state.activations, rows - actions + number, lane)
        put(
            state.action,
            0,
            lane,
            choose(output > best, np.float32(number), get(state.action, 0, lane)),
        )
        best = choose(output > best, output, best)


@hook
def move(part: Any, model: Any, state: Any, lane: Lane) -> None:
    """Turn and move the agent by its action.

    Per agent, once per step, after `choose_action`. It reads `state.action`, and writes
    `state.heading` and
    `state.positions`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def forward(part: Any, weights: Any, activations: Any, lane: Lane) -> None:
    """Compute the outputs of the network from its inputs.

    Per agent, once per step, and for a reinforcement module once more. The first rows of
    `activations`
    are the inputs; the hook writes the other rows. The last rows are the outputs.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    weights : array, float32 [weight, lane]
        Weights of the module. Read only.
    activations : array, float32 [unit, lane]
        Activations of all units.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def backward(
    part: Any, rate: Value, weights: Any, activations: Any, errors: Any, targets: Any, lane: Lane
) -> None:
    """Change the weights so that the outputs move towards the targets.

    Per agent. Learning rules call it after `forward`, with the activations of that call.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    rate : float32, or a SIMD block
        Learning rate of the agent.
    weights : array, float32 [weight, lane]
        Weights of the module. The hook changes them.
    activations : array, float32 [unit, lane]
        Activations of all units. Read only.
    errors : array, float32 [unit, lane]
        Scratch memory.
    targets : array, float32 [action, lane]
        Target of each output. Read only.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def links(part: Any, weights: Any, units: int, lane: int, table: Any) -> int:
    """Write the links of a network without layers, for drawings.

    Per agent, on demand. It is called in plain Python.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    weights : array, float32 [weight, lane]
        Weights of the module. Read only.
    units : int
        Number of units.
    lane : int
        Column of the agent.
    table : array [weight, 3]
        Output: source unit, target unit and weight of each link. The source of a bias is -1.

    Returns
    -------
    int
        Number of links. 0 for a network with layers.
    """
    return 0


@hook
def load_genes(part: Any, model: Any, state: Any, genes: Any, lane: Lane) -> None:
    """Store the genes of further modules in the arrays of the part.

    Per agent, at birth, before `init_agent`. `state.weights` already holds the action module.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    genes : array, float32 [gene, lane]
        Weights of all modules after the action module, one module after the other. Read only.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def init_agent(part: Any, model: Any, state: Any, world: int, agent: int) -> None:
    """Initialize the arrays of the part for a newborn agent.

    Per agent, at birth, after `load_genes`. The position, heading and weights of the agent are set.
    It may write the column of the agent in the arrays of the part and in `state`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world, agent : int
        Indices of the world and of the agent in it. The lane is `world * model.agents + agent`.
    """


@hook
def observe_others(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Compute data about other agents before the agents learn.

    Per world, once per step, after all agents have acted. It may read all agents, and write the
    arrays of the part and per-agent arrays of `state`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world : int
        Index of the world.
    step : int
        Step of the lifetime, from 0.
    """


@hook
def learn(part: Any, model: Any, state: Any, step: int, lane: Lane) -> None:
    """Change the weights of an agent.

    Per agent, once per step, after `observe_others`, while the agent learns (`learning.steps`). It
    writes
    `state.weights` and the column of the agent in the arrays of the part.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    step : int
        Step of the lifetime, from 0.
    lane : Lane
        Column of an agent, or a SIMD block.
    """


@hook
def init_world(part: Any, model: Any, state: Any, world: int) -> None:
    """Initialize the arrays of the part for a world.

    Per world, at the beginning of a lifetime, before agents and items are placed.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world : int
        Index of the world.
    """


@hook
def blocks_placement(part: Any, model: Any, x: np.float32, y: np.float32) -> bool:
    """Return whether agents and items cannot be placed at a position.

    Called for each candidate position of a newborn or an item. It writes nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    x, y : float32
        Position, in units of length. y points down.

    Returns
    -------
    bool
        True if the position is blocked. False by default.
    """
    return False


@hook
def blocks_sight(part: Any, model: Any, x: np.float32, y: np.float32, dx: Value, dy: Value) -> Mask:
    """Return whether an item or agent cannot be seen.

    Per agent, for each seen candidate. It writes nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    x, y : float32
        Position of the agent, in units of length. y points down.
    dx, dy : float32, or a SIMD block
        Offset of the seen item or agent.

    Returns
    -------
    bool, or a mask
        True where the view from (x, y) to (x + dx, y + dy) is blocked. False by default.
    """
    # False for each item, as a bool or as a mask.
    return dx * ZERO > ONE


@hook
def blocks_movement(part: Any, model: Any, x: Value, y: Value) -> Mask:
    """Return whether an agent cannot enter a position.

    Per agent, when it moves. An agent that tries stays at its position. It writes nothing.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    x, y : float32, or a SIMD block
        New position, in units of length. y points down.

    Returns
    -------
    bool, or a mask
        True where the position cannot be entered. False by default.
    """
    return x * ZERO > ONE


@hook
def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Change the world at the end of a step.

    Per world, after all agents have eaten. It may write the arrays of the part, items and agents
    of the
    world.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings, derived values and arrays of the part.
    model : Model
        Constants of the lifetime. Read only.
    state : State
        Arrays of the step, and the other parts.
    world : int
        Index of the world.
    step : int
        Step of the lifetime, from 0.
    """


class Sense(Part):
    """Sense of an agent: inputs of its network, 0 or 1, or real numbers in [0, 1].

    Attributes
    ----------
    inputs : tuple of str
        Names of the inputs.
    sectors : tuple of (float, float) or None
        Angular range of each input, in degrees clockwise from the heading, for drawings. None: no
        range.
    item_kind : str
        Kind of the items that the helper `sense_items` looks for. "" is food.
    only_items : bool
        True if the inputs depend on items alone. Then the sense is skipped where no item is near.
    is_continuous : bool
        True if `measure` writes the inputs, False if `sense` returns them as bits.
    """

    kind: ClassVar[str] = "sense"
    inputs: ClassVar[tuple[str, ...]] = ()
    sectors: ClassVar[tuple[tuple[float, float] | None, ...]] = ()
    item_kind: ClassVar[str] = ""
    only_items: ClassVar[bool] = False
    is_continuous: ClassVar[bool] = False

    sense: ClassVar[Any] = staticmethod(sense.default)
    measure: ClassVar[Any] = staticmethod(measure.default)
    prepare_senses: ClassVar[Any] = staticmethod(prepare_senses.default)


class Body(Part):
    """Body of an agent: its actions and its movement.

    Attributes
    ----------
    actions : tuple of str
        Names of the actions. Each is an output of the network.
    stride : float
        Maximum distance of a step, in units of length.
    chooses : bool
        True if an agent performs one action per step. False if it uses all outputs.
    """

    kind: ClassVar[str] = "body"
    actions: ClassVar[tuple[str, ...]] = ()
    stride: ClassVar[float] = 2.0
    chooses: ClassVar[bool] = True

    choose_action: ClassVar[Any] = staticmethod(choose_action.default)
    move: ClassVar[Any] = staticmethod(move.default)


class Network(Part):
    """Network of an agent: outputs from inputs.

    Units are numbered from the inputs to the outputs. Weights are numbered in the order of the
    genome.

    Attributes
    ----------
    is_memoryless : bool
        True if the outputs depend on the current inputs alone. Then outputs may be looked up.
    infinite_genes : tuple of int
        Indices in a module of the genes that may be infinite. All other genes must be finite.
    """

    kind: ClassVar[str] = "network"
    is_memoryless: ClassVar[bool] = True
    infinite_genes: ClassVar[tuple[int, ...]] = ()

    def layers(self, inputs: int, hidden: tuple[int, ...], actions: int) -> tuple[int, ...]:
        """Return the number of units in each layer, from the inputs to the outputs.

        Parameters
        ----------
        inputs : int
            Number of inputs: the first units.
        hidden : tuple of int
            The setting `network.hidden`.
        actions : int
            Number of outputs: the last units.
        """
        return (inputs, *hidden, actions)

    def memory(
        self, inputs: int, hidden: tuple[int, ...], actions: int
    ) -> tuple[tuple[int, int], ...]:
        """Return the context units of a recurrent network, for drawings.

        Returns
        -------
        tuple of (int, int)
            Pairs of a unit and of the unit that holds its activation of the previous step.
        """
        return ()

    forward: ClassVar[Any] = staticmethod(forward.default)
    backward: ClassVar[Any] = staticmethod(backward.default)
    links: ClassVar[Any] = staticmethod(links.default)


class LearningRule(Part):
    """Learning rule: the change of the weights of an agent during its lifetime.

    Attributes
    ----------
    modules : tuple of str
        Modules of a genome, of equal size. The first is "action". A second module "reinforcement"
        is a
        network whose outputs the engine writes to `state.targets` in each step.
    learns : bool
        False for a rule that changes no weights.
    supports_drift_control : bool
        True if the rule moves weights as far as self-teaching does, so that `drift` is its control.
    answers : tuple of str
        Names of the outputs of the reinforcement module, if they are not actions.
    teacher_array : str
        Name of the int array of the part with the teacher of each agent, or "". The index of the
        agent
        itself means that it has no teacher.
    color : str
        Color of the rule in figures, a name of `baldwinlab.analysis.palette`.
    """

    kind: ClassVar[str] = "learning rule"
    modules: ClassVar[tuple[str, ...]] = ("action",)
    learns: ClassVar[bool] = True
    supports_drift_control: ClassVar[bool] = False
    answers: ClassVar[tuple[str, ...]] = ()
    teacher_array: ClassVar[str] = ""
    color: ClassVar[str] = "blue"

    load_genes: ClassVar[Any] = staticmethod(load_genes.default)
    init_agent: ClassVar[Any] = staticmethod(init_agent.default)
    observe_others: ClassVar[Any] = staticmethod(observe_others.default)
    learn: ClassVar[Any] = staticmethod(learn.default)


class ItemRegion(Fields):
    """Rectangle with uniformly placed items. An eaten item reappears in its region at once.

    Attributes
    ----------
    kind : str
        Kind of the items, such as "food".
    x, y : (float, float)
        Left and right, upper and lower edge, in units of length.
    count : int
        Number of items.
    energy : float
        Energy of an item.
    color : str
        Color of the items, a name of the palette or "#rrggbb".
    """

    kind: str
    x: tuple[float, float]
    y: tuple[float, float]
    count: int
    energy: float
    color: str


class WorldFeature(Part):
    """Feature of the world: items, walls, and changes over time.

    Attributes
    ----------
    allows_births : bool
        True if agents are born during a lifetime.
    """

    kind: ClassVar[str] = "world feature"
    allows_births: ClassVar[bool] = False

    def items(self) -> tuple[ItemRegion, ...]:
        """Return the regions of items that the feature adds to the food of the world."""
        return ()

    def map_shapes(self) -> tuple[dict[str, Any], ...]:
        """Return the shapes of the feature on drawn maps.

        Returns
        -------
        tuple of dict
            {"shape": "rectangle", "x": (left, right), "y": (upper, lower), "color", "label"}
        """
        return ()

    init_world: ClassVar[Any] = staticmethod(init_world.default)
    blocks_placement: ClassVar[Any] = staticmethod(blocks_placement.default)
    blocks_sight: ClassVar[Any] = staticmethod(blocks_sight.default)
    blocks_movement: ClassVar[Any] = staticmethod(blocks_movement.default)
    end_step: ClassVar[Any] = staticmethod(end_step.default)


def compiled_values(part: Part, experiment: Any, allocate: Callable[[Array], Any]) -> Any:
    """Return the first argument of the hooks of a part: its settings, derived values and arrays."""
    own: dict[str, Any] = {}
    for name in numeric_fields(type(part)):
        value = getattr(part, name)
        own[name] = (
            np.float32(value) if type(part).model_fields[name].annotation is float else value
        )
    derived = {name: make(part, experiment) for name, make in type(part).derived.items()}
    return part.Compiled(
        **own, **derived, **{name: allocate(array) for name, array in type(part).arrays.items()}
    )
