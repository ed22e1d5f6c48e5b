"""The token of a lab, which keeps other users of the machine from reading studies."""

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
# Characters of the hash of the served folder.
HASH_LENGTH: Final = 16
TOKEN_PATTERN: Final = re.compile(r"[\w-]{43,}", re.ASCII)


class Access:
    """The token of one lab, and tickets that replace it once.

    Every user of a machine can read the command lines of its processes, and a command line contains
    the address that a browser opens. Such an address therefore contains a ticket, which is invalid
    after its first use.

    `token`: None creates a new one.
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
    """Return the name of the token's cookie, which contains the port.

    Browsers send a cookie to every port of a host.
    """
    return f"baldwinlab-{port}"


def load_token(root: Path, port: int) -> str:
    """Return the token of the lab that serves a folder at a port, and store a new token.

    If the folder of the user's state cannot be used, the token is valid until the lab is closed.
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
    """Return the text of a file, or "" if it is damaged or other users could have read it."""
    try:
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return ""
    with os.fdopen(descriptor, encoding="ascii", errors="replace") as file:
        status = os.fstat(descriptor)
        # On Windows, the folders of a user are readable only for the user.
        is_private = not hasattr(os, "getuid") or (
            status.st_uid == os.getuid() and not status.st_mode & (stat.S_IRWXG | stat.S_IRWXO)
        )
        text = file.read() if is_private and stat.S_ISREG(status.st_mode) else ""
    return text if TOKEN_PATTERN.fullmatch(text) else ""


def _write_private(path: Path, token: str) -> None:
    """Write a file that only the user can read. A complete file replaces an older one."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    partial_path = path.with_name(f".{path.name}.{uuid4().hex}")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    with os.fdopen(os.open(partial_path, flags, 0o600), "w", encoding="ascii") as file:
        file.write(token)
    partial_path.replace(path)
