"""One file from a public address, kept only if its content has the pinned checksum."""

import shutil
import sys
import urllib.error
import urllib.request
from collections.abc import Callable, Iterable
from pathlib import Path

from lowalt.files.atomic import replacing, sha256
from lowalt.files.errors import InputError

TIMEOUT_S = 60


def download(
    address: str, target: Path, pinned: str, checksum: Callable[[Path], str] = sha256
) -> None:
    """Write the file at `address` to `target` if `checksum` of it is `pinned`.

    Raises: InputError naming the address where the download fails or the content differs; then
    nothing is kept.
    """
    with replacing(target) as temporary:
        try:
            with (
                urllib.request.urlopen(address, timeout=TIMEOUT_S) as source,
                temporary.open("wb") as file,
            ):
                shutil.copyfileobj(source, file)
        except (urllib.error.URLError, OSError, ValueError) as error:
            raise InputError(f"{address}: download failed ({error})") from None
        digest = checksum(temporary)
        if digest != pinned:
            raise InputError(f"{address}: SHA-256 is {digest}, expected {pinned}; nothing was kept")


def fetch_each(names: Iterable[str], fetch: Callable[[str], bool]) -> None:
    """Call `fetch` for each file's name and print the result, also after one that fails.

    fetch: returns False if the file existed already. Failures go to standard error.
    Raises: InputError with the count of files that failed.
    """
    names = list(names)
    failed = 0
    for name in names:
        try:
            fetched = fetch(name)
            print(name, "fetched" if fetched else "already there")
        except InputError as error:
            failed += 1
            print(f"failed: {error}", file=sys.stderr)
    if failed:
        raise InputError(
            f"{failed} of {len(names)} files could not be fetched (named above), the others are "
            "there"
        )
