"""One file from a public address, kept only if its content is the pinned one. No stage is known here."""

import shutil
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

from lowalt.common.errors import InputError
from lowalt.common.files import replacing, sha256

TIMEOUT_S = 60


def download(address: str, target: Path, pinned: str, checksum: Callable[[Path], str] = sha256) -> None:
    """Write the file at `address` to `target` if `checksum` of it is `pinned`.

    Raises: InputError naming the address where the download fails or the content is another; nothing is kept then.
    """
    with replacing(target) as temporary:
        try:
            with urllib.request.urlopen(address, timeout=TIMEOUT_S) as source, temporary.open("wb") as file:
                shutil.copyfileobj(source, file)
        except (urllib.error.URLError, OSError, ValueError) as error:
            raise InputError(f"{address}: download failed ({error})") from None
        found = checksum(temporary)
        if found != pinned:
            raise InputError(f"{address}: SHA-256 is {found}, expected {pinned}; nothing was kept")
