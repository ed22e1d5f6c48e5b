"""Tuples of arrays that compiled functions pass by address.

Numba passes the items of a tuple as separate arguments. A state of sixty arrays has five hundred
arguments, and these arguments take longer to compile than the work of a function. So the functions
of a step pass an address instead. Inlining removes the address from the machine code.

A `Scattered` reference is a list of addresses, one per field of the tuple. The index of a field in
the list does not depend on the types of other fields. So one compiled function can serve all tuples
that have the same types in the fields that the function reads (`inlining.py`). Browsers pass a
`Reference`, the address of a tuple in memory.
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
    """The address of a named tuple in memory."""

    def __init__(self, tuple_type: Any) -> None:
        self.tuple_type = tuple_type
        super().__init__(f"{type(self).__name__}({tuple_type})")

    def field(self, name: str) -> Any:
        """Return the type of a field of the tuple."""
        return self.tuple_type.types[self.tuple_type.fields.index(name)]

    @property
    def key(self) -> Any:
        """The tuple type, by which Numba compares references. Names of types can be equal."""
        return self.tuple_type


class Scattered(Reference):
    """The address of the addresses of the fields of a named tuple."""


@register_model(Reference)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, data_type(kind.tuple_type).as_pointer())


@register_model(Scattered)
class _ScatteredModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _ADDRESS.as_pointer())


@infer_getattr
class _Attributes(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:
        return reference.field(name) if name in reference.tuple_type.fields else None


def _load_field(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    index = kind.tuple_type.fields.index(name)
    field = kind.field(name)
    if isinstance(kind, Scattered):
        address = builder.load(cgutils.gep(builder, value, index))
        pointer = builder.bitcast(address, data_type(field).as_pointer())
    else:
        # The 0 selects the tuple at the address, and `index` selects the field in the tuple.
        pointer = cgutils.gep_inbounds(builder, value, 0, index)
    return load_value(context, builder, field, pointer)


lower_getattr_generic(Reference)(_load_field)


def as_pointer(values: Any) -> Any:
    """Return a reference to a named tuple. Plain Python returns the tuple."""
    return values


def _emit_as_pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kinds = signature.args[0].types
    addresses = cgutils.alloca_once(builder, _ADDRESS, size=len(kinds))
    for number, kind in enumerate(kinds):
        field = builder.extract_value(arguments[0], number)
        address = builder.bitcast(spill_value(context, builder, kind, field), _ADDRESS)
        builder.store(address, cgutils.gep(builder, addresses, number))
    return addresses


def dereference(reference: Any) -> Any:
    """Return a named tuple of the fields of a reference. No field may be replaced afterwards."""
    return reference


def _emit_dereference(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = signature.args[0]
    fields = [
        _load_field(context, builder, kind, arguments[0], name) for name in kind.tuple_type.fields
    ]
    return make_tuple(context, builder, kind.tuple_type, fields)


# The types of the two functions in compiled code: tuple to `Scattered`, and reference to tuple.
type_callable(as_pointer)(lambda context: lambda tuple_type: Scattered(tuple_type))
lower_builtin(as_pointer, BaseNamedTuple)(_emit_as_pointer)
type_callable(dereference)(
    lambda context: (
        lambda reference: reference.tuple_type if isinstance(reference, Reference) else None
    )
)
lower_builtin(dereference, Reference)(_emit_dereference)
