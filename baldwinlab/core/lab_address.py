"""The address of the lab, for the server and for links to it."""

from __future__ import annotations

from typing import Final

LAB_HOST: Final = "127.0.0.1"
DEFAULT_LAB_PORT: Final = 8642
