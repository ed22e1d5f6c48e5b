"""The token of a lab, which keeps other users of the machine from reading studies."""

from __future__ import annotations

import secrets
from typing import Final

MISSING_TOKEN_ERROR: Final = (
    "this lab needs its token: open the address that the command baldwinlab lab printed"
)


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
