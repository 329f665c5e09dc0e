"""The guard before the page: who gets in, and what every answer says about itself."""

from collections.abc import Mapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
import ipaddress
import secrets
import socket
from typing import Final
from urllib.parse import parse_qs, urlsplit

from page_node.refusal import RefusedError

#: What a browser may do with what it got: nothing from elsewhere, nothing inline, in no frame.
HEADERS: Final[Mapping[str, str]] = {
    'Content-Security-Policy': (
        "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; "
        "form-action 'self'; frame-ancestors 'none'"),
    'Cross-Origin-Opener-Policy': 'same-origin',
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Permissions-Policy': 'camera=(), geolocation=(), microphone=()',
    'Referrer-Policy': 'no-referrer',
    'X-Content-Type-Options': 'nosniff',
    'X-Frame-Options': 'DENY',
}
#: Random part of a token that is made, [bytes].
_TOKEN_BYTES: Final = 18


@dataclass(frozen=True)
class AccessPolicy:
    """
    Who may come in.

    Parameters
    ----------
    token : str
        What everybody has to know; empty: nothing.
    names : frozenset of str
        Names of this machine, in small letters, besides `localhost` and any address.
    cookie : str
        Name of the cookie that holds the token.

    """

    token: str
    names: frozenset[str]
    cookie: str

    def check_host(self, host: str) -> None:
        """
        Refuse a name that is not ours: a page from elsewhere may call us by one of its own.

        An address of numbers cannot be such a name.

        Raises
        ------
        RefusedError
            If it is not.

        """
        name = host_name(host)
        if not (name == 'localhost' or name in self.names or _is_address(name)):
            raise RefusedError(
                'wrong_host', 'this machine is not called so: see the parameter names of '
                'page_node', 421)

    def check_origin(self, host: str, headers: Mapping[str, str], is_reading: bool) -> None:
        """
        Refuse what a page from elsewhere asks for.

        Parameters
        ----------
        host : str
            How the browser calls us.
        headers : mapping
            By small letters.
        is_reading : bool
            Whether it may come without an Origin, as what is typed into the address bar does.

        Raises
        ------
        RefusedError
            If it does not come from a page of ours.

        """
        origin = headers.get('origin')
        if origin is None:
            if not is_reading:
                raise RefusedError('no_origin', 'this has to come from the page itself', 403)
            self._check_fetch(headers)
        elif not is_origin_of(origin, host):
            raise RefusedError('wrong_origin', 'this comes from another page', 403)

    def _check_fetch(self, headers: Mapping[str, str]) -> None:
        """Let others link here, but not read, embed or frame anything."""
        site = headers.get('sec-fetch-site', 'none')
        is_link = (headers.get('sec-fetch-mode'), headers.get('sec-fetch-dest')) == (
            'navigate', 'document')
        if site not in ('none', 'same-origin') and not is_link:
            raise RefusedError('wrong_origin', 'this comes from another page', 403)

    def knows(self, headers: Mapping[str, str], query: str) -> bool:
        """Return whether somebody has the token, in a cookie or in the address."""
        if not self.token:
            return True
        return self._fits(_cookie(headers.get('cookie', ''), self.cookie)) or (
            self.is_shown_in(query))

    def is_shown_in(self, query: str) -> bool:
        """Return whether the token stands in the address, behind the question mark."""
        given = parse_qs(query, keep_blank_values=True).get('token', [''])[-1]
        return bool(self.token) and self._fits(given)

    def _fits(self, given: str) -> bool:
        return secrets.compare_digest(given.encode(), self.token.encode())


def make_policy(host: str, port: int, token: str, names: str) -> AccessPolicy:
    """
    Return who may come in at an address that is listened on.

    Parameters
    ----------
    host, port
        What is listened on.
    token : str
        One that is set; empty: none on this machine alone, else one is made.
    names : str
        More names of this machine, separated by blanks.

    """
    own = socket.gethostname().lower()
    known = {own, own.partition('.')[0], f'{own.partition(".")[0]}.local'} - {''}
    if not is_loopback(host):
        token = token or secrets.token_urlsafe(_TOKEN_BYTES)
    else:
        known = set()
    return AccessPolicy(token, frozenset({*known, *names.lower().split()}), f'page_token_{port}')


def is_loopback(host: str) -> bool:
    """Return whether an address can be reached from this machine only."""
    if host == 'localhost':
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def host_name(host: str) -> str:
    """Return the name or address in a Host header, in small letters, without port and brackets."""
    try:
        parts = urlsplit(f'//{host}')
        return '' if parts.port == 0 else (parts.hostname or '').rstrip('.')
    except ValueError:
        return ''


def is_origin_of(origin: str, host: str) -> bool:
    """Return whether an origin is a page of this host, with its port."""
    scheme, _, rest = origin.partition('://')
    return scheme in ('http', 'https') and rest.lower() == host.lower()


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _cookie(header: str, name: str) -> str:
    try:
        morsel = SimpleCookie(header).get(name)
    except CookieError:
        return ''
    return '' if morsel is None else morsel.value
