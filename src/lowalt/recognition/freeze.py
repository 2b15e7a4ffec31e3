"""Frozen inputs: checksums of clouds and motion tables, checked before every use.

They are written before the first training.
The file has the form of `sha256sum`, so `sha256sum --check SHA256SUMS` verifies it without our
code.
"""

from pathlib import Path

from lowalt.files.atomic import existing, sha256, text_of, write_file
from lowalt.files.errors import InputError


def freeze(paths: list[str | Path], out: str | Path) -> None:
    """Write the SHA-256 of every file, sorted by name; paths are relative to the folder of `out`.

    Raises: InputError for a missing file, one given twice, or one outside that folder.
    """
    folder = Path(out).resolve().parent
    named: list[tuple[str, str]] = []
    for path in paths:
        full = existing(path, "file to freeze").resolve()
        if not full.is_relative_to(folder):
            raise InputError(f"{path}: not below {folder}, where {Path(out).name} is to stand")
        named.append((full.relative_to(folder).as_posix(), sha256(full)))
    if len(set(named)) < len(named):
        raise InputError(f"{out}: a file was given twice")
    lines = [f"{digest}  {name}\n" for name, digest in sorted(named)]
    write_file(out, "".join(lines))


def verify(sums: str | Path) -> int:
    """Check every file of a checksum list and return how many there are.

    Raises: InputError naming the first file that is missing or has changed since it was frozen.
    """
    folder = existing(sums, "checksums").resolve().parent
    lines = text_of(sums, "checksums").splitlines()
    for number, line in enumerate(lines, start=1):
        digest = line[:64]
        gap = line[64:66]
        name = line[66:]
        if gap != "  " or not name:
            raise InputError(
                f"{sums} line {number}: {line!r}, expected a SHA-256, two spaces and a path"
            )
        # For a name with a null byte, which no file has, `resolve` raises a ValueError.
        if "\0" in name or not (folder / name).resolve().is_relative_to(folder):
            raise InputError(f"{sums} line {number}: {name!r}, expected a file below {folder}")
        if sha256(existing(folder / name, "frozen file")) != digest:
            raise InputError(f"{folder / name}: has changed since it was frozen in {sums}")
    return len(lines)
