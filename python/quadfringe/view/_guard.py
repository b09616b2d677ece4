"""Who may open the live page: requests are judged by their Host, their Origin and their token.

A browser lets any page send requests to any address, and DNS rebinding lets it read the answers. Both show in the
request: the Host is a name that is not ours, or the Origin is another page.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from http import HTTPStatus
from ipaddress import ip_address
from secrets import compare_digest
from typing import Protocol
from urllib.parse import parse_qsl

__all__ = ["Guard", "Headers", "Refusal"]

HOST = re.compile(r"(\[[0-9a-f:.]+\]|[a-z0-9._-]+)(:[0-9]{1,5})?")
TOKEN = "token"
UNKNOWN_NAME = "expected a name of this machine or one given with --allow-host"
FOREIGN_PAGE = "the live page answers only to itself, not to other pages"
NO_PARAMETERS = "the live page takes no parameter but token"
NEEDS_TOKEN = "the live page needs its token: open the address that quadfringe printed, which ends in ?token=..."


class Headers(Protocol):
    """The header fields of a request."""

    def get_all(self, key: str) -> list[str]:
        """Return every value of a field, none when it is absent."""


@dataclass(frozen=True)
class Refusal:
    """The answer to a request that is refused: status and one line of text."""

    status: HTTPStatus
    text: str


@dataclass(frozen=True)
class Guard:
    """Refuses requests that do not come from a page of this server under one of its names.

    `names` are the host names, lower case, under which the page may be opened. Addresses of this machine's loopback
    interface are always allowed; other addresses only with a token, because a page cannot be rebound to a number.
    With a `token`, a request needs it in its URL or in the cookie named `cookie`.
    """

    names: Collection[str]
    token: str | None
    cookie: str

    def refusal(self, target: str, headers: Headers) -> Refusal | None:
        """Judge a request for `target`, a path with its query; None when it is allowed."""
        host = _only(headers, "Host").lower()
        origins = headers.get_all("Origin")
        if not self._knows(host):
            return Refusal(HTTPStatus.FORBIDDEN, f"{UNKNOWN_NAME}, got {host[:80]!r}")
        if origins and _only(headers, "Origin").lower() not in (f"http://{host}", f"https://{host}"):
            return Refusal(HTTPStatus.FORBIDDEN, FOREIGN_PAGE)
        query = parse_qsl(target.partition("?")[2], keep_blank_values=True)
        # The page obeys other parameters: ?websocket=... lets it take its contents, scripts included, from elsewhere.
        if any(name != TOKEN for name, _ in query):
            return Refusal(HTTPStatus.BAD_REQUEST, NO_PARAMETERS)
        if self.token is not None and not self._proved(dict(query), headers):
            return Refusal(HTTPStatus.FORBIDDEN, NEEDS_TOKEN)
        return None

    def set_cookie(self) -> str | None:
        """Give the value of the header Set-Cookie, with which the page proves itself from then on."""
        return None if self.token is None else f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"

    def _knows(self, host: str) -> bool:
        matched = HOST.fullmatch(host)
        if matched is None:
            return False
        name = matched[1].strip("[]").removesuffix(".")
        try:
            return ip_address(name).is_loopback or self.token is not None
        except ValueError:
            return name == "localhost" or name in self.names

    def _proved(self, query: dict[str, str], headers: Headers) -> bool:
        assert self.token is not None
        cookies = (part.strip().partition("=") for part in ";".join(headers.get_all("Cookie")).split(";"))
        given = [value for name, _, value in cookies if name == self.cookie] + [query.get(TOKEN, "")]
        # Headers may hold any bytes, and servers of other ports of this name may set the cookie.
        return any(compare_digest(value.encode(errors="surrogateescape"), self.token.encode()) for value in given)


def _only(headers: Headers, name: str) -> str:
    """Return a field that must occur once; "" when it is absent or repeated."""
    values = headers.get_all(name)
    return values[0] if len(values) == 1 else ""
