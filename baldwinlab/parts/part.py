"""The base class of all kinds of parts, and functions that list the hooks and records of a part.

A part is a subclass of a kind of part, with a name: `class Social(LearningRule, name="social")`.

- Annotations are settings of the experiment.
- `arrays` declares the arrays of the part.
- Static methods are hooks, compiled by Numba. A part inherits every hook that it does not define.

The kind declares the names of the arguments of each hook. The first argument is the part: a
NamedTuple of the numeric settings, the `derived` values and the arrays of the part.

Parts of agents and of the world have two types of hooks. A *per-agent* hook is called for one
lane: the column of one agent in arrays [row, lane], or a SIMD block of 16 such columns. The hook
must not read other agents. It reads and writes its lane only by `get` and `put`. A *per-world* hook
may read and write the arrays of all agents of its world: `prepare_senses`, `observe_others`,
`init_world`, `end_step`.

A *record* is an array with one number per agent that a part writes during a lifetime. The study
stores the values at the end of the lifetime.

The fields of `model` and `state` are described in `MiniWorldModel` and `State` of
`baldwinlab/models/miniworld/state.py`.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.phases import RECORD_TYPES, Array, for_each_part, make_part_type, part_class
from baldwinlab.experiment import registry
from baldwinlab.experiment.fields import Fields
from baldwinlab.parts.genes import FIRST_GENE, Gene, add_gene_arrays, require_valid_genes
from baldwinlab.parts.lane_check import find_definition, require_lane_isolation

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass as FieldsMeta
else:
    FieldsMeta = type(Fields)
# Kinds of parts with hooks that create generations. Such parts have no arrays of agents.
BREEDING_KINDS: Final = ("selection", "variation", "inheritance", "fitness", "stop")
# Hooks that read results of lifetimes.
READING_HOOKS: Final = ("evaluate", "select", "should_stop")


class PartMeta(FieldsMeta):
    """Metaclass of parts. `loading` registers a function that pickles classes of this metaclass."""


class Part(Fields, metaclass=PartMeta):
    """Base class of all kinds of part.

    The annotations of a part are settings of the experiment: pydantic fields with a description, a
    unit and limits. An experiment chooses a part by its name.

    Attributes
    ----------
    kind : str
        Kind of part, such as "sense". Set by the kind.
    name : str
        Name of the part. Set by `class X(Kind, name="x")`.
    arrays : Mapping[str, Array]
        Arrays of the part by name, declared with `per_agent`, `per_world` or `per_run`. A
        dimension is a number, or "weights", "units", "inputs" or "actions".
    records : Mapping[str, Array]
        Recorded arrays [1, lane] by name, declared with `per_agent`. A record is 0 at birth. The
        value at the end of the lifetime is stored with the run.
    read_records : tuple of str
        Names of the records that the hooks of the part read. Set from the source of the hooks.
    derived : Mapping[str, Callable]
        Functions of (part, experiment) by name. Hooks read the results, numbers or arrays, as
        `part.NAME`.
    required_settings : Mapping[str, Any]
        Settings by dotted path that an experiment with the part needs, for `baldwinlab check`.
    genes : Mapping[str, Gene]
        Genes of the part by name. In hooks of a lifetime, `part.NAME` is an array [1, lane] with
        the gene of each agent. In hooks of evolution, `part.NAME` is the index of the gene in the
        first module of a genome.
    adds_hooks : bool
        True for a base class of parts whose static methods are further hooks, such as
        `SynapticRule`.
    Compiled : type
        NamedTuple class of the first argument of the hooks.
    """

    kind: ClassVar[str] = ""
    name: ClassVar[str] = ""
    arrays: ClassVar[Mapping[str, Array]] = {}
    # The values are of the type Array, or Variable in a model.
    records: ClassVar[Mapping[str, Any]] = {}
    read_records: ClassVar[tuple[str, ...]] = ()
    derived: ClassVar[Mapping[str, Callable[[Any, Any], Any]]] = {}
    required_settings: ClassVar[Mapping[str, Any]] = {}
    genes: ClassVar[Mapping[str, Gene]] = {}
    adds_hooks: ClassVar[bool] = False
    Compiled: ClassVar[type]

    def __init_subclass__(cls, name: str = "", **options: Any) -> None:
        super().__init_subclass__(**options)

    @classmethod
    def __pydantic_init_subclass__(cls, name: str = "", **options: Any) -> None:
        super().__pydantic_init_subclass__(**options)
        # A kind or a common base class of parts has no name.
        if not name:
            return
        is_built_in = registry.is_built_in(cls.kind, name, cls.__module__)
        _require_signatures(cls)
        cls.name = name
        if cls.kind != "model":
            add_record_arrays(cls)
        cls.read_records = list_read_records(cls)
        taken_names = dict.fromkeys([*cls.model_fields, *cls.derived]) | dict(cls.arrays)
        require_valid_genes(cls, taken_names)
        cls.genes = dict(sorted(cls.genes.items()))
        # Genes are the last fields: arrays in parts of a lifetime, indices in parts of evolution.
        gene_fields: list[str] = list(cls.genes)
        if cls.genes and cls.kind not in BREEDING_KINDS:
            add_gene_arrays(cls)
            gene_fields = []
        first_gene = [FIRST_GENE] if cls.genes else []
        fields = [*numeric_fields(cls), *cls.derived, *first_gene, *cls.arrays, *gene_fields]
        make_part_type(cls, fields)
        if not is_built_in:
            hooks = {hook_name: getattr(cls, hook_name) for hook_name in overridden_hooks(cls)}
            require_lane_isolation(hooks, cls.arrays)
            registry.add(cls.kind, name, cls)

    @classmethod
    def hooks(cls) -> tuple[Callable[..., Any], ...]:
        """Return the functions of all hooks of the part."""
        return tuple(getattr(cls, hook_name) for hook_name in hook_names(cls))

    def check(self, experiment: Any) -> None:
        """Check that the part fits an experiment.

        Parameters
        ----------
        experiment : BaseExperiment
            Experiment with the part.

        Raises
        ------
        ValueError
            If the part cannot be used with these settings. The message is shown to the user.
        """


def hook_names(kind: type[Part]) -> list[str]:
    """Return the names of the hooks of a kind, then of base classes that add hooks."""
    return list(_default_hooks(kind))


def overridden_hooks(part: type[Part]) -> list[str]:
    """Return the names of the hooks that a part overrides, in the order of its kind."""
    defaults = _default_hooks(part)
    return [name for name, default in defaults.items() if getattr(part, name) is not default]


def numeric_fields(part: type[Part]) -> list[str]:
    """Return the names of the settings that compiled code can read."""
    return [
        name for name, info in part.model_fields.items() if info.annotation in (int, float, bool)
    ]


def compiled_values(part: Part, experiment: Any, allocate: Callable[[Array], Any]) -> Any:
    """Return the first argument of the hooks of a part. `allocate` makes a declared array."""
    kind = type(part)
    settings: dict[str, Any] = {}
    for name in numeric_fields(kind):
        value = getattr(part, name)
        is_float = kind.model_fields[name].annotation is float
        settings[name] = np.float32(value) if is_float else value
    derived = {name: derive(part, experiment) for name, derive in kind.derived.items()}
    arrays = {name: allocate(array) for name, array in kind.arrays.items()}
    genes: dict[str, Any] = {}
    if kind.genes:
        indices = {name: experiment.gene_index(name) for name in kind.genes}
        genes[FIRST_GENE] = min(indices.values())
        genes |= indices if kind.kind in BREEDING_KINDS else {}
    return part.Compiled(**settings, **derived, **arrays, **genes)


def _require_signatures(part: type[Part]) -> None:
    """Raise TypeError if a hook of a part does not have the arguments of its kind."""
    for name, default in _default_hooks(part).items():
        required = [*inspect.signature(default).parameters]
        attribute = vars(part).get(name)
        if attribute is not None and not isinstance(attribute, staticmethod):
            raise TypeError(
                f"{part.__name__}.{name} must be a static method: "
                f"@staticmethod def {name}({', '.join(required)})"
            )
        if [*inspect.signature(getattr(part, name)).parameters] != required:
            raise TypeError(
                f"{part.__name__}.{name} must have the arguments of its kind: "
                f"{name}({', '.join(required)})"
            )


def _default_hooks(part: type[Part]) -> dict[str, Callable[..., Any]]:
    """Return the default of each hook by name: of the kind, then of bases that add hooks."""
    defaults: dict[str, Callable[..., Any]] = {}
    # The reversed order begins with the kind, and `setdefault` keeps the first default of a hook.
    for base in reversed(part.__mro__):
        is_kind = Part in base.__bases__
        if is_kind or vars(base).get("adds_hooks"):
            for name, value in vars(base).items():
                if isinstance(value, staticmethod):
                    defaults.setdefault(name, getattr(base, name))
    return defaults


def add_record_arrays(part: Any) -> None:
    """Declare an array for each record of a part, after the other arrays of the part."""
    for name, array in part.records.items():
        is_number = isinstance(array, Array) and (array.owner, array.rows) == ("agent", (1,))
        if not is_number or array.dtype not in RECORD_TYPES:
            raise TypeError(
                f"{part.__name__}.records: {name!r} must be one number of an agent: "
                'per_agent("float32") or per_agent("int32")'
            )
        if part.arrays.get(name, array) is not array:
            raise TypeError(f"{part.__name__}.records: {name!r} is also the name of an array")
    arrays = {name: array for name, array in part.arrays.items() if name not in part.records}
    part.arrays = arrays | dict(part.records)


def list_read_records(part: Any) -> tuple[str, ...]:
    """Return the names of the records that the hooks of a part read."""
    hooks = [getattr(part, name) for name in READING_HOOKS if hasattr(part, name)]
    names: dict[str, None] = {}
    for definition in map(find_definition, hooks):
        for node in ast.walk(definition) if definition is not None else ():
            if isinstance(node, ast.Attribute) and _is_records(node.value):
                names[node.attr] = None
    return tuple(names)


def _is_records(node: ast.expr) -> bool:
    # In `lifetimes.records.NAME`, the node is `lifetimes.records`.
    return isinstance(node, ast.Attribute) and node.attr == "records"


@compiled
def _clear_array(array: Any, lane: int) -> None:
    array[0, lane] = 0


_clear_arrays = for_each_part(_clear_array)


def clear_part_records(part: Any, lane: int) -> None:
    """Set the records of an agent to 0. Compiled code calls it at birth."""
    for name in _record_names(type(part).part):
        getattr(part, name)[0, lane] = 0


def _record_names(part: Any) -> tuple[str, ...]:
    return tuple(getattr(part, "records", ()))


def _choose_clear(part: Any, lane: Any) -> Callable[..., None]:
    """Return the source of `clear_part_records` for the type of a part."""
    holder = part_class(part)
    names = _record_names(holder)
    if not names:
        return lambda part, lane: None
    # The records are successive fields of a compiled part.
    first = holder.Compiled._fields.index(names[0])
    end = first + len(names)
    return lambda part, lane: _clear_arrays(part[first:end], lane)


register(clear_part_records, _choose_clear)
