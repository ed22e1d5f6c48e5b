"""The token of a lab: a secret, without which other users of the machine cannot read studies."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import stat
from contextlib import suppress
from pathlib import Path
from typing import Final
from uuid import uuid4

import platformdirs

MISSING_TOKEN_ERROR: Final = (
    "this lab needs its token: open the address that the command baldwinlab lab printed"
)
# Number of characters of the hash of the served folder, in the name of the token's file.
HASH_LENGTH: Final = 16
# `secrets.token_urlsafe` makes a token of 43 characters.
TOKEN_PATTERN: Final = re.compile(r"[\w-]{43,}", re.ASCII)


class Access:
    """The token of one lab, and tickets: secrets that are valid once instead of the token.

    The command line of a browser's process contains the address that the browser opens, and every
    user of a machine can read command lines. Such an address therefore contains a ticket.

    `token`: None creates a new token.
    """

    def __init__(self, token: str | None = None) -> None:
        self.token: Final = token or secrets.token_urlsafe()
        self._tickets = set[str]()

    def issue_ticket(self) -> str:
        """Return a new ticket."""
        ticket = secrets.token_urlsafe()
        self._tickets.add(ticket)
        return ticket

    def is_token(self, text: str) -> bool:
        """Return whether a text is the token. The comparison takes constant time."""
        return secrets.compare_digest(text.encode(), self.token.encode())

    def accept(self, text: str) -> bool:
        """Return whether a text is the token or an unused ticket, and mark the ticket as used."""
        if text not in self._tickets:
            return self.is_token(text)
        self._tickets.remove(text)
        return True


def make_cookie_name(port: int | None) -> str:
    """Return the name of the cookie that contains the token, such as "baldwinlab-8642".

    The name contains the port, because browsers send a cookie to every port of a host.
    """
    return f"baldwinlab-{port}"


def load_token(root: Path, port: int) -> str:
    """Return the stored token of the lab that serves a folder at a port, or store a new one.

    If the file cannot be written, the new token is valid until the lab is closed.
    """
    name = hashlib.sha256(os.fsencode(root.resolve())).hexdigest()[:HASH_LENGTH]
    path = Path(platformdirs.user_state_dir("baldwinlab")) / "lab" / f"{name}-{port}.token"
    token = _read_private(path)
    if not token:
        token = secrets.token_urlsafe()
        with suppress(OSError):
            _write_private(path, token)
    return token


def _read_private(path: Path) -> str:
    """Return the token in a file; "" if it is invalid, or if other users could read the file."""
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return ""
    with os.fdopen(descriptor, encoding="ascii", errors="replace") as file:
        status = os.fstat(descriptor)
        # Windows has no user ids, and only the user can read the user's folders.
        is_private = not hasattr(os, "getuid") or (
            status.st_uid == os.getuid() and not status.st_mode & (stat.S_IRWXG | stat.S_IRWXO)
        )
        text = file.read() if is_private and stat.S_ISREG(status.st_mode) else ""
    return text if TOKEN_PATTERN.fullmatch(text) else ""


def _write_private(path: Path, token: str) -> None:
    """Write a file that only the user can read. An older file is replaced when it is complete."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    partial_path = path.with_name(f".{path.name}.{uuid4().hex}")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    with os.fdopen(os.open(partial_path, flags, 0o600), "w", encoding="ascii") as file:
        file.write(token)
    partial_path.replace(path)
