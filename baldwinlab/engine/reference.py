"""A tuple of arrays handed on by its address, in compiled code.

Numba spreads a tuple over the arguments of every function that is given it: a state of sixty arrays is five hundred arguments,
which takes longer to compile than what is done with them. Once all is inlined, nothing is left of the address.
"""

from __future__ import annotations

from typing import Any

from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.imputils import lower_getattr_generic
from numba.core.types.containers import BaseNamedTuple
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import lower_builtin, register_model, type_callable


class Reference(types.Type):
    """The address of a named tuple."""

    def __init__(self, held: Any) -> None:
        self.held = held
        super().__init__(f"Reference({held})")

    @property
    def key(self) -> Any:
        """What makes two of these equal: the tuples' types, for those of different classes may have the same name."""
        return self.held


@register_model(Reference)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, manager.lookup(kind.held).get_data_type().as_pointer())


@infer_getattr
class _Attributes(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, reference: Any, name: str) -> Any:
        held = reference.held
        return held.types[held.fields.index(name)] if name in held.fields else None


def _load(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    index = kind.held.fields.index(name)
    pointer = cgutils.gep_inbounds(builder, value, 0, index)
    return context.data_model_manager[kind.held.types[index]].load_from_data_pointer(builder, pointer)


lower_getattr_generic(Reference)(_load)


def by_reference(held: Any) -> Any:
    """A named tuple, handed on by its address from here. In plain Python: as it is."""
    return held


def _store(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    model = context.data_model_manager[signature.args[0]]
    place = cgutils.alloca_once(builder, model.get_data_type())
    builder.store(model.as_data(builder, arguments[0]), place)
    return place


def taken(reference: Any) -> Any:
    """The named tuple at an address, where nobody changes it any more. In plain Python: as it is."""
    return reference


def _take(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return context.data_model_manager[signature.return_type].load_from_data_pointer(builder, arguments[0])


type_callable(by_reference)(lambda context: lambda held: Reference(held))
lower_builtin(by_reference, BaseNamedTuple)(_store)
type_callable(taken)(lambda context: lambda reference: reference.held if isinstance(reference, Reference) else None)
lower_builtin(taken, Reference)(_take)
