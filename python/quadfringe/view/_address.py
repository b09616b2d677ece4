"""Where the live page is served: an address of this machine and a free port."""

from __future__ import annotations

import errno
import socket
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address

from quadfringe.errors import InputError

__all__ = ["LOOPBACK", "Address", "listen"]

LOOPBACK = "127.0.0.1"
EXPECTED = f"expected an address of this machine: {LOOPBACK} for this machine alone, 0.0.0.0 for the whole network"
RESOLVE_S = 0.8  # a name that no name server knows takes many seconds; the error must come within one
PORTS = 100  # ports that are tried


@dataclass(frozen=True)
class Address:
    """A listening socket, and the host as it was given."""

    host: str
    listening: socket.socket

    @property
    def port(self) -> int:
        """The port, which may be a later one than asked for."""
        return int(self.listening.getsockname()[1])

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach the socket."""
        return self._bound.is_loopback

    @property
    def url(self) -> str:
        """The address of the page, by the name of this machine when all of its addresses are served."""
        host = socket.gethostname() if self._bound.is_unspecified else self.host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}"

    def names(self, more: Iterable[str]) -> frozenset[str]:
        """Give the names of the page, lower case: the given host, `more`, and on a network that of this machine."""
        own = () if self.is_loopback else (socket.gethostname(),)
        return frozenset(name.lower().removesuffix(".") for name in (self.host, *own, *more))

    @property
    def _bound(self) -> IPv4Address | IPv6Address:
        return ip_address(self.listening.getsockname()[0].partition("%")[0])


def listen(host: str, port: int) -> Address:
    """Open a socket at an address or name of this machine, at `port` or at the next free one.

    Raises `InputError` within a second for a host that is unknown or belongs to another machine, and when no port is
    free.
    """
    if not 1 <= port <= 65535:
        raise InputError(f"port: expected 1 to 65535, got {port}")
    found = _resolved(host)
    both = found.family == socket.AF_INET6 and found.number == "::" and socket.has_dualstack_ipv6()
    for attempt in range(port, min(port + PORTS, 65536)):
        try:
            place = (found.number, attempt)
            return Address(host, socket.create_server(place, family=found.family, dualstack_ipv6=both))
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                reason = error.strerror or error
                raise InputError(f"host: cannot serve at {host!r}, port {attempt}: {reason}; {EXPECTED}") from error
    raise InputError(f"port: {port} and the {PORTS - 1} after it are taken; give another one")


@dataclass(frozen=True)
class _Resolved:
    family: socket.AddressFamily
    number: str


def _resolved(host: str) -> _Resolved:
    """Resolve a host name in limited time."""
    found: list[_Resolved] = []

    def resolve() -> None:
        try:
            family, _, _, _, address = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0]
        except (OSError, UnicodeError, ValueError):
            return
        found.append(_Resolved(family, str(address[0])))

    if host:  # an empty name would mean all addresses
        resolver = threading.Thread(target=resolve, name="resolve", daemon=True)
        resolver.start()
        resolver.join(RESOLVE_S)
    if not found:
        raise InputError(f"host: {host!r} is not known here; {EXPECTED}")
    return found[0]
