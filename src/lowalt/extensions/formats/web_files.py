"""Byte ranges of a data set's files on a web server, and the addresses of these files."""

import functools
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import quote, urljoin, urlsplit, urlunsplit

from lowalt.files.errors import InputError, in_one_line, shortened

TIMEOUT_S = 60
MOST_REDIRECTS = 5


def beside(index: str, name: str) -> str:
    """Return the address of a file by its path relative to the folder of an index.

    The index's query is kept.
    Characters with a meaning in addresses are escaped, so the name cannot lead to another server or
    query.
    """
    parts = urlsplit(index)
    return urlunsplit(parts._replace(path=f"{parts.path.rpartition('/')[0]}/{quote(name)}"))


@functools.cache
def _session(process: int) -> Any:
    """The open connections of a process, never those of the process that it was forked from."""
    # Imported here: who reads from disk need not wait for it.
    import requests

    session = requests.Session()
    retry = requests.adapters.Retry(3, backoff_factor=0.2, status_forcelist=(429, 502, 503, 504))
    for scheme in ("http://", "https://"):
        session.mount(scheme, requests.adapters.HTTPAdapter(max_retries=retry))
    return session


def _refuse_other_host(address: str, following: str) -> None:
    """Refuse to follow a redirect to another host or port, or from https to http.

    A server could otherwise make this machine ask others of its network. From http to https of the
    same host is allowed. Raises: InputError naming both addresses.
    """
    here = urlsplit(address.lower())
    there = urlsplit(following.lower())
    same = (there.scheme, there.netloc) == (here.scheme, here.netloc)
    secured = (here.scheme, there.scheme) == ("http", "https")
    if not same and not (secured and there.netloc == here.hostname):
        raise InputError(
            f"{address}: the server leads to {shortened(following, 100)}, expected an address on "
            "the same host, and of https where this one is"
        )


def span(address: str, first: int, most: int) -> bytes:
    """Return at most `most` bytes of a file from byte `first` on.

    Raises: InputError naming the address where there is no such file, the server does not answer,
    sends whole files only, or leads to another host or from https to http.
    """
    import requests

    asked = {"Range": f"bytes={first}-{first + most - 1}", "Accept-Encoding": "identity"}
    following = address
    try:
        for _ in range(MOST_REDIRECTS + 1):
            with _session(os.getpid()).get(
                following,
                headers=asked,
                stream=True,
                timeout=TIMEOUT_S,
                allow_redirects=False,
            ) as answer:
                if answer.is_redirect:
                    following = urljoin(following, answer.headers["Location"])
                    _refuse_other_host(address, following)
                    continue
                if answer.status_code == requests.codes.ok:
                    raise InputError(
                        f"{address}: the server sends whole files only, expected one that sends "
                        "byte ranges"
                    )
                if answer.status_code != requests.codes.partial_content:
                    raise InputError(
                        f"{address}: the server answers {answer.status_code} ({answer.reason})"
                    )
                return next(answer.iter_content(most), b"")
    except requests.RequestException as error:
        # What ended the last of several attempts.
        cause: Exception = error
        if error.args:
            cause = getattr(error.args[0], "reason", error)
        raise InputError(f"{address}: cannot be read ({in_one_line(cause)})") from None
    raise InputError(f"{address}: cannot be read (more than {MOST_REDIRECTS} redirects)")


@contextmanager
def fetched(address: str, most: int) -> Iterator[Path]:
    """Yield a temporary copy of the first `most` bytes of a file.

    A memory map of it remains valid afterwards.
    Raises: as `span`.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / Path(urlsplit(address).path).name
        path.write_bytes(span(address, 0, most))
        yield path
