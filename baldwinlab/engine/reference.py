"""A tuple of arrays handed on by its address, in compiled code.

Numba spreads a tuple over the arguments of every function that is given it: a state of sixty arrays
is five hundred arguments, which takes longer to compile than what is done with them. Once all is
inlined, nothing is left of the address.

What is handed on is a list of addresses, one for each field. So where a field is found does not
depend on what the others are, and a function serves all tuples that are alike in what it reads of
them (`inlined.py`). A tuple as it lies in memory is what browsers hand in.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, models, register_model, type_callable

from baldwinlab.engine.numba_internals.lowering import (
    AttributeTemplate,
    BaseNamedTuple,
    cgutils,
    data_type,
    infer_getattr,
    load_value,
    lower_getattr_generic,
    make_tuple,
    spill_value,
)

_ADDRESS = ir.IntType(8).as_pointer()


class Reference(types.Type):  # type: ignore[misc]
    """The address of a named tuple, as it lies in memory."""

    def __init__(self, held: Any) -> None:
        self.held = held
        super().__init__(f"{type(self).__name__}({held})")

    def field(self, name: str) -> Any:
        """The type of a field of the tuple."""
        return self.held.types[self.held.fields.index(name)]

    @property
    def key(self) -> Any:
        """What makes two of these equal: the tuples' types, for those of different classes may have the same name."""
        return self.held


class Scattered(Reference):
    """The address of a named tuple's fields' addresses."""


@register_model(Reference)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, data_type(kind.held).as_pointer())


@register_model(Scattered)
class _ScatteredModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _ADDRESS.as_pointer())


@infer_getattr
class _Attributes(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:
        return reference.field(name) if name in reference.held.fields else None


def _load(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    index, field = kind.held.fields.index(name), kind.field(name)
    if isinstance(kind, Scattered):
        place = builder.load(cgutils.gep(builder, value, index))
        pointer = builder.bitcast(place, data_type(field).as_pointer())
    else:
        pointer = cgutils.gep_inbounds(builder, value, 0, index)
    return load_value(context, builder, field, pointer)


lower_getattr_generic(Reference)(_load)


def as_pointer(held: Any) -> Any:
    """A named tuple, handed on by its address from here. In plain Python: as it is."""
    return held


def _store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kinds = signature.args[0].types
    places = cgutils.alloca_once(builder, _ADDRESS, size=len(kinds))
    for number, kind in enumerate(kinds):
        field = builder.extract_value(arguments[0], number)
        place = spill_value(context, builder, kind, field)
        builder.store(builder.bitcast(place, _ADDRESS), cgutils.gep(builder, places, number))
    return places


def dereference(reference: Any) -> Any:
    """The named tuple at an address, where nobody changes it any more. In plain Python: as it is."""
    return reference


def _take(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0]
    fields = [_load(context, builder, kind, arguments[0], name) for name in kind.held.fields]
    return make_tuple(context, builder, kind.held, fields)


type_callable(as_pointer)(lambda context: lambda held: Scattered(held))
lower_builtin(as_pointer, BaseNamedTuple)(_store)
type_callable(dereference)(
    lambda context: lambda reference: reference.held if isinstance(reference, Reference) else None
)
lower_builtin(dereference, Reference)(_take)
