"""Names that become files or folders, and that exist on every operating system."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

# Windows reserves these names, also with an ending, for devices.
DEVICE_NAMES: Final = frozenset(
    {"con", "prn", "aux", "nul"}
    | {f"{port}{number}" for port in ("com", "lpt") for number in range(10)}
)


def find_name_fault(name: str) -> str:
    """Return why a name cannot be a file on every operating system, or ""."""
    for folder in name.split("/"):
        if folder.partition(".")[0].casefold() in DEVICE_NAMES:
            return f"Windows reserves {folder!r} for a device"
        if folder.endswith((".", " ")):
            return f"Windows removes the dot or space at the end of {folder!r}"
    return ""


def find_case_collision(names: Iterable[str]) -> tuple[str, str] | None:
    """Return two names that are one file on macOS and Windows, which ignore case; None if none."""
    name_by_folded: dict[str, str] = {}
    for name in names:
        first_name = name_by_folded.setdefault(name.casefold(), name)
        if first_name != name:
            return first_name, name
    return None
