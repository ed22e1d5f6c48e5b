"""The kinds of part, and the hooks of each: what a part of that kind may do, when, and with what.

A part is a class derived from one of these kinds, with a name: `class Social(LearningRule, name="social")`. Its annotations are
fields of the experiment; `arrays` declares what it works on; its static methods are its hooks. A hook that it has not is
the one written here. Phases take the part first: in compiled code that is a NamedTuple of its numeric fields, of what is
`derived` and of its arrays. Their arguments are named as here. What the others are:

    model   what never changes in a life: see models/miniworld/state.py, `Model`
    state   what does, and the other parts: state.network, state.rule, state.body, state.senses, state.features
    lane    an agent's column in arrays [row, lane], or a bundle of sixteen; only `get` and `put` reach it
    world, agent   numbers; the agent's lane is world * model.agents + agent

A *per-agent* hook must not read other agents. A *per-world* hook may read all of them: `prepare_senses`,
`observe_others`, `init_world`, `end_step`.
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
    """A piece of a model. Its fields are the experiment's; `name` is what chooses it.

    arrays   by name, declared with `per_agent` or `per_world`; rows are numbers or "weights", "units", "inputs", "actions"
    derived  by name, a function of (part, experiment) whose number or array the hooks need
    needs    settings, by dotted path, without which it can be in no experiment: what `baldwinlab check` tries it with
    """

    kind: ClassVar[str] = ""
    name: ClassVar[str] = ""
    arrays: ClassVar[Mapping[str, Array]] = {}
    derived: ClassVar[Mapping[str, Callable[[Any, Any], Any]]] = {}
    required_settings: ClassVar[Mapping[str, Any]] = {}
    Compiled: ClassVar[type]  # the NamedTuple that its hooks get

    def __init_subclass__(cls, name: str = "", **options: Any) -> None:
        super().__init_subclass__(**options)

    @classmethod
    def __pydantic_init_subclass__(cls, name: str = "", **options: Any) -> None:
        super().__pydantic_init_subclass__(**options)
        if not name:
            return  # a kind, or a base that parts share
        built_in = registry.is_built_in(cls.kind, name, cls.__module__)
        _require_signatures(cls)
        cls.name = name
        made: Any = namedtuple("Compiled", [*numeric_fields(cls), *cls.derived, *cls.arrays])  # type: ignore[misc]
        made.__module__, made.__qualname__ = (
            cls.__module__,
            f"{cls.__qualname__}.Compiled",
        )  # so that Numba's cache finds it
        setattr(made, "part", cls)  # noqa: B010  (it is the class of a tuple, of which mypy knows all attributes)
        cls.Compiled = made
        if not built_in:
            require_own_column(
                {each: getattr(cls, each) for each in overridden_hooks(cls)}, cls.arrays
            )
            registry.add(cls.kind, name, cls)

    @classmethod
    def hooks(cls) -> tuple[Callable[..., Any], ...]:
        """The functions of its hooks, its own or the kind's."""
        return tuple(getattr(cls, each) for each in hook_names(cls))

    def check(self, experiment: Any) -> None:
        """Raises ValueError, with a sentence, where the part cannot be in that experiment."""


def hook_names(kind: type[Part]) -> list[str]:
    """The names of the hooks that parts of a kind have."""
    base = next(each for each in kind.__mro__ if Part in each.__bases__)
    return [name for name, value in vars(base).items() if isinstance(value, staticmethod)]


def overridden_hooks(part: type[Part]) -> list[str]:
    """The names of the hooks that a part does not leave to its kind."""
    return [name for name in hook_names(part) if getattr(part, name) is not _of_kind(part, name)]


def numeric_fields(part: type[Part]) -> list[str]:
    """The fields that compiled code can read: numbers, true and false."""
    return [
        name for name, info in part.model_fields.items() if info.annotation in (int, float, bool)
    ]


def _require_signatures(part: type[Part]) -> None:
    for name in hook_names(part):
        wanted = [*inspect.signature(_of_kind(part, name)).parameters]
        given = vars(part).get(name)
        if given is not None and not isinstance(given, staticmethod):
            raise TypeError(
                f"{part.__name__}.{name} must be a static method: @staticmethod def {name}({', '.join(wanted)})"
            )
        if [*inspect.signature(getattr(part, name)).parameters] != wanted:
            raise TypeError(
                f"{part.__name__}.{name} must have the arguments of its kind: {name}({', '.join(wanted)})"
            )


def _of_kind(part: type[Part], name: str) -> Callable[..., Any]:
    base = next(each for each in part.__mro__ if Part in each.__bases__)
    return getattr(base, name)  # type: ignore[no-any-return]


@hook
def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
    """Per agent: which of the part's inputs are 1, as bits, the first input's the lowest."""
    return 0


@hook
def measure(part: Any, model: Any, state: Any, world: int, agent: int, first: int) -> None:
    """Per agent, of a sense that is `is_continuous`: its inputs, each in [0, 1], into state.activations from the row `first` on."""


@hook
def prepare_senses(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Per world, before anybody senses: what a sense needs of others. It may write what is the agents'."""


@hook
def choose_action(part: Any, model: Any, state: Any, lane: Lane) -> None:
    """Per agent: the action, into state.action: unless the body says otherwise, the largest output, a tie going to the first."""
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
    """Per agent: do the action: turn, and change place."""


@hook
def forward(part: Any, weights: Any, activations: Any, lane: Lane) -> None:
    """Per agent: fill `activations` [unit, lane] from its first rows, the inputs, to its last, the outputs."""


@hook
def backward(
    part: Any, rate: Value, weights: Any, activations: Any, errors: Any, targets: Any, lane: Lane
) -> None:
    """Per agent: change `weights` so that the outputs move towards `targets`. `errors` [unit, lane] is scratch."""


@hook
def links(part: Any, weights: Any, units: int, lane: int, found: Any) -> int:
    """Per agent, of a network that is no layers, for whoever draws: fill `found`, and say how many links there are.

    It is [link, (from unit, to unit, weight)], with room for as many as there are weights; a unit that is always 1 is -1.
    """
    return 0


@hook
def load_genes(part: Any, model: Any, state: Any, genes: Any, lane: Lane) -> None:
    """Per agent, at birth and before `init_agent`: keep what life needs of the genome's modules beside the action module.

    Their weights are in `genes` [module and weight, lane], one module after another.
    """


@hook
def init_agent(part: Any, model: Any, state: Any, world: int, agent: int) -> None:
    """Per agent, at birth: make the part's arrays ready. The weights are there already."""


@hook
def observe_others(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Per world, when all have acted and before anybody learns: what needs a look at others. It may write what is the agents'."""


@hook
def learn(part: Any, model: Any, state: Any, step: int, lane: Lane) -> None:
    """Per agent: change state.weights."""


@hook
def init_world(part: Any, model: Any, state: Any, world: int) -> None:
    """Per world, at its beginning: make the part's arrays ready. Nobody is born yet, nothing has grown."""


@hook
def blocks_placement(part: Any, model: Any, x: np.float32, y: np.float32) -> bool:
    """Per agent: whether nobody can be born, and nothing grow, at a place."""
    return False


@hook
def blocks_sight(part: Any, model: Any, x: np.float32, y: np.float32, dx: Value, dy: Value) -> Mask:
    """Per agent: whether what is at (x + dx, y + dy) cannot be seen from (x, y)."""
    return dx * ZERO > ONE  # false, for each item


@hook
def blocks_movement(part: Any, model: Any, x: Value, y: Value) -> Mask:
    """Per agent: whether nobody can step to (x, y): who would stays where it is."""
    return x * ZERO > ONE


@hook
def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Per world, at the end of a step: what changes in the world by itself."""


class Sense(Part):
    """What an agent is told of its surroundings: inputs of its network, 0 or 1, or real-valued, between them."""

    kind: ClassVar[str] = "sense"
    inputs: ClassVar[tuple[str, ...]] = ()  # their names
    sectors: ClassVar[
        tuple[tuple[float, float] | None, ...]
    ] = ()  # where each looks, degrees clockwise from the heading
    item_kind: ClassVar[str] = ""  # of items that it looks for by `see`
    only_items: ClassVar[bool] = (
        False  # tells of items alone, so it need not be asked where none are near
    )
    is_continuous: ClassVar[bool] = (
        False  # whether its inputs are what `measure` writes, and not the bits that `sense` gives
    )

    sense: ClassVar[Any] = staticmethod(sense.default)
    measure: ClassVar[Any] = staticmethod(measure.default)
    prepare_senses: ClassVar[Any] = staticmethod(prepare_senses.default)


class Body(Part):
    """What an agent can do."""

    kind: ClassVar[str] = "body"
    actions: ClassVar[tuple[str, ...]] = ()  # their names; each is an output of the network
    stride: ClassVar[float] = 2.0  # the longest way in one step, units of length
    chooses: ClassVar[bool] = (
        True  # does one of its actions in a step, and not something of all of them
    )

    choose_action: ClassVar[Any] = staticmethod(choose_action.default)
    move: ClassVar[Any] = staticmethod(move.default)


class Network(Part):
    """What turns inputs into outputs: layers of units, whose activations and weights are numbered from the inputs on."""

    kind: ClassVar[str] = "network"
    is_memoryless: ClassVar[bool] = True  # whether the outputs follow from the inputs alone
    infinite_genes: ClassVar[
        tuple[int, ...]
    ] = ()  # by number in a module: those that may be infinite; no others may

    def layers(self, inputs: int, hidden: tuple[int, ...], actions: int) -> tuple[int, ...]:
        """Units in each layer. The first `inputs` units are the inputs, the last `actions` ones the outputs."""
        return (inputs, *hidden, actions)

    def memory(
        self, inputs: int, hidden: tuple[int, ...], actions: int
    ) -> tuple[tuple[int, int], ...]:
        """Units that remember, for whoever draws: pairs of a unit, and of the one that remembers what it was a step before."""
        return ()

    forward: ClassVar[Any] = staticmethod(forward.default)
    backward: ClassVar[Any] = staticmethod(backward.default)
    links: ClassVar[Any] = staticmethod(links.default)


class LearningRule(Part):
    """What changes an agent's weights in life."""

    kind: ClassVar[str] = "learning rule"
    modules: ClassVar[tuple[str, ...]] = (
        "action",
    )  # in a genome, each of as many weights; the networks among them are
    # "action", the first, and "reinforcement", the second where there is one, whose answer is then in state.targets
    learns: ClassVar[bool] = True
    supports_drift_control: ClassVar[bool] = (
        False  # whether it goes as far as self-teaching, so that drift, which does, is a control for it
    )
    answers: ClassVar[
        tuple[str, ...]
    ] = ()  # what the reinforcement module says, where that is not how to act: "gate", say
    teacher_array: ClassVar[str] = (
        ""  # the array of its own, of whole numbers, that holds from which agent each learns; itself: nobody
    )
    color: ClassVar[str] = "blue"  # of `baldwinlab.analysis.figures.palette`

    load_genes: ClassVar[Any] = staticmethod(load_genes.default)
    init_agent: ClassVar[Any] = staticmethod(init_agent.default)
    observe_others: ClassVar[Any] = staticmethod(observe_others.default)
    learn: ClassVar[Any] = staticmethod(learn.default)


class ItemRegion(Fields):
    """A rectangle in which items of a kind lie uniformly; an eaten one reappears in its own region at once."""

    kind: str
    x: tuple[float, float]
    y: tuple[float, float]
    count: int
    energy: float
    color: str


class WorldFeature(Part):
    """What else there is in the world: kinds of items, walls, whatever hides, stops or moves."""

    kind: ClassVar[str] = "world feature"
    allows_births: ClassVar[bool] = (
        False  # whether agents are born in mid-life, by `succeed` of models/miniworld/birth.py
    )

    def items(self) -> tuple[ItemRegion, ...]:
        """The items that it adds to the world's food."""
        return ()

    def map_shapes(self) -> tuple[dict[str, Any], ...]:
        """What is drawn of it: {"shape": "rectangle", "x": (left, right), "y": (upper, lower), "color", "label"}."""
        return ()

    init_world: ClassVar[Any] = staticmethod(init_world.default)
    blocks_placement: ClassVar[Any] = staticmethod(blocks_placement.default)
    blocks_sight: ClassVar[Any] = staticmethod(blocks_sight.default)
    blocks_movement: ClassVar[Any] = staticmethod(blocks_movement.default)
    end_step: ClassVar[Any] = staticmethod(end_step.default)


def compiled_values(part: Part, experiment: Any, allocate: Callable[[Array], Any]) -> Any:
    """The NamedTuple that a part's hooks get."""
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
