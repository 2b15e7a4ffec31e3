"""Provenance of a run: revision of the code, changes of the configuration, checksums, commands."""

import hashlib
import subprocess
from pathlib import Path
from typing import Any

import yaml

from lowalt.config.layers import plain
from lowalt.files.atomic import sha256
from lowalt.files.package_plan import PACKAGE
from lowalt.files.shipped import SHIPPED

COUNTED = (".py", ".smk", ".yaml")
"""Suffixes of the package's files that determine a run's products."""


def revision(folder: Path = SHIPPED) -> str:
    """Return the commit of the checkout in `folder` and how many of its tracked files differ.

    "no checkout" if the folder is not the root of a checkout, or git is not installed.
    """
    if not (folder / ".git").exists():
        return "no checkout"
    git = ["git", "-C", str(folder)]
    try:
        commit = subprocess.run(
            [*git, "rev-parse", "HEAD"], capture_output=True, text=True, check=True
        ).stdout.strip()
        state = [*git, "status", "--porcelain", "--untracked-files=no"]
        changed = subprocess.run(
            state, capture_output=True, text=True, check=True
        ).stdout.splitlines()
    except (OSError, subprocess.CalledProcessError):
        return "no checkout"
    if not changed:
        return commit
    plural = "s" if len(changed) > 1 else ""
    return f"{commit}, {len(changed)} tracked file{plural} changed since"


def code_sum(folder: Path = PACKAGE) -> str:
    """Return one SHA-256 of all source files of the package, by name and content.

    No version control is used.
    Compiled files are excluded.
    """
    whole = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.suffix in COUNTED and "shipped" not in path.relative_to(folder).parts:
            whole.update(f"{path.relative_to(folder).as_posix()} {sha256(path)}\n".encode())
    return whole.hexdigest()


def changes(base: dict, config: dict) -> dict:
    """Return the smallest overlay that turns the configuration `base` into `config`.

    A key that `config` lacks becomes null, which removes a station or a spectrum. Infinities are
    equal as numbers and as the words that stand for them in JSON; the overlay has numbers.
    """
    found = _differing(plain(base), plain(config))
    return _numbers(found)


def _numbers(value: Any) -> Any:
    """The value with the words "inf" and "-inf" as numbers."""
    if isinstance(value, dict):
        return {key: _numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_numbers(item) for item in value]
    if value in ("inf", "-inf"):
        return float(value)
    return value


def _differing(base: dict, config: dict) -> dict:
    """The keys of `changes` with their values, infinities as words."""
    differing: dict = {}
    for key in [*config, *(key for key in base if key not in config)]:
        value = config.get(key)
        base_value = base.get(key)
        if isinstance(value, dict) and isinstance(base_value, dict):
            inner = _differing(base_value, value)
            if inner:
                differing[key] = inner
        elif key not in config or key not in base or value != base_value:
            differing[key] = value
    return differing


def checksums(files: dict[str, str | list[str]]) -> list[dict]:
    """Return path, bytes and SHA-256 of every file of a manifest.

    files: path or list of paths by name; those of benchmarks and of the kept reference are left
    out. Files with several names are listed once.
    """
    paths: list[str] = []
    for name, of_name in files.items():
        if name != "benchmarks" and not name.startswith("kept_"):
            if isinstance(of_name, str):
                of_name = [of_name]
            paths += of_name
    return [
        {"path": path, "bytes": Path(path).stat().st_size, "sha256": sha256(path)}
        for path in dict.fromkeys(paths)
    ]


def commands(commit: str, overlay: dict) -> tuple[str, str]:
    """Return the commands that repeat a run, and the text of the overlay they name (may be empty).

    commit: as `revision` gives it; overlay: as `changes` gives it.
    """
    lines = []
    if commit != "no checkout":
        lines.append(f"git checkout {commit.partition(',')[0]}")
    if not overlay:
        return "\n".join([*lines, "make"]), ""
    lines += ["make .venv/set-up", ".venv/bin/lowalt run again.yaml"]
    return "\n".join(lines), yaml.safe_dump(overlay, sort_keys=False, allow_unicode=True)
