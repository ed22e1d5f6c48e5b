"""A message for the end of the process by compiled code of a custom part."""

from __future__ import annotations

import ctypes
import faulthandler
import signal
from collections.abc import Sequence
from functools import cache
from typing import Any

from numba import cfunc, types

from baldwinlab.core.console import escape_controls, shorten_paths
from baldwinlab.experiment import registry

# Signals of a hook that writes outside its arrays. Windows has no such signals.
SIGNAL_NAMES = ("SIGSEGV", "SIGBUS", "SIGABRT")
STDERR = 2
DEFAULT_ACTION = 0
MAX_BYTES = 4000
_sentence = ctypes.create_string_buffer(MAX_BYTES)
_choices: set[tuple[str, str]] = set()


def report_crashes(choices: Sequence[tuple[str, str]]) -> None:
    """Name the simulated custom parts if their compiled code ends this process.

    `choices`: kind and name of each custom part of an experiment. Without custom parts, and if the
    user has enabled the fault handler of Python, the function changes nothing.
    """
    if not choices or not hasattr(signal, "SIGBUS") or faulthandler.is_enabled():
        return
    _choices.update(choices)
    parts = [origin.describe() for origin in registry.find_origins(_choices)]
    text = escape_controls(
        f"baldwinlab: compiled code accessed memory outside its arrays, in "
        f"{shorten_paths(' or '.join(parts))}; baldwinlab check FILE finds the line"
    )
    content = text.encode()[: MAX_BYTES - 2] + b"\n"
    ctypes.memmove(_sentence, content + b"\0", len(content) + 1)
    handler = _compile_handler()
    for name in SIGNAL_NAMES:
        _find_signal_function()(getattr(signal, name), handler.address)


def _find_signal_function() -> Any:
    # Python calls a handler of `signal.signal` between instructions, which a crash never reaches.
    function = ctypes.CDLL(None).signal
    function.argtypes = (ctypes.c_int, ctypes.c_void_p)
    return function


@cache
def _compile_handler() -> Any:
    """Compile the handler of the signals, which may call only a few functions of C."""
    length = types.ExternalFunction("strlen", types.intp(types.intp))
    write = types.ExternalFunction("write", types.intp(types.int32, types.intp, types.intp))
    set_action = types.ExternalFunction("signal", types.intp(types.int32, types.intp))
    address = ctypes.addressof(_sentence)

    def handle(number: Any) -> None:
        write(STDERR, address, length(address))
        # The failing instruction runs again, and ends the process with the status of the signal.
        set_action(number, DEFAULT_ACTION)

    return cfunc(types.void(types.int32))(handle)
