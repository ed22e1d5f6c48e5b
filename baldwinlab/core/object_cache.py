"""Cache of the results of a function of an immutable object, such as an experiment.

`functools.lru_cache` compares all settings of two equal experiments at each call, which takes
longer than the lookups of a generation.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])


def cache_per_object(function: Function) -> Function:
    """Let a function compute its result once for each object and its further arguments.

    The first argument is the object. The result is removed with the object, so the result must not
    refer to it.
    """
    results: dict[tuple[Any, ...], tuple[weakref.ref[Any], Any]] = {}

    @wraps(function)
    def call(owner: Any, *arguments: Any) -> Any:
        key = (id(owner), *arguments)
        stored = results.get(key)
        if stored is None:
            result = function(owner, *arguments)
            stored = weakref.ref(owner, lambda _: results.pop(key, None)), result
            results[key] = stored
        return stored[1]

    return cast(Function, call)
