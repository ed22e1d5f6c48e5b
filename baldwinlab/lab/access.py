"""The token of a lab: without it, no other user of the machine reads its studies or starts runs."""

from __future__ import annotations

import secrets
from typing import Final

REFUSAL: Final = (
    "this lab needs its token: open the address that the command `baldwinlab lab` printed"
)


class Access:
    """The token of one lab, and tickets that stand for it once.

    Every user of a machine can read the command lines of its processes, and the address that a browser opens is part of
    one. Such an address therefore carries a ticket, which is worthless after its first use.
    """

    def __init__(self) -> None:
        self.token: Final = secrets.token_urlsafe()
        self._tickets = set[str]()

    def issue_ticket(self) -> str:
        """Return a new ticket."""
        ticket = secrets.token_urlsafe()
        self._tickets.add(ticket)
        return ticket

    def is_token(self, text: str) -> bool:
        """Return whether a text is the token, in a time that does not depend on the text."""
        return secrets.compare_digest(text.encode(), self.token.encode())

    def admits(self, text: str) -> bool:
        """Return whether a text is the token or a ticket; a ticket is used up."""
        if text not in self._tickets:
            return self.is_token(text)
        self._tickets.remove(text)
        return True


def cookie_name(port: int | None) -> str:
    """Return the name of the cookie that holds the token: browsers send a cookie to every port of a host."""
    return f"baldwinlab-{port}"
