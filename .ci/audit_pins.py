"""The pinned packages held against the known vulnerabilities; where those cannot be had, a table of versions and dates.

    python .ci/audit_pins.py --pins envs/constraints.txt --out .venv/pins.csv [--only NAME ...]

Asks pip-audit first, which needs the internet. Where it has no answer, one line says so, and the package index is asked
for the release date and the newest version of each pin (PEP 691 and 700); what it does not tell stays empty. Ends with
status 1 where a pin has a known vulnerability, and with status 3 where nobody could say.
"""

import argparse
import csv
import json
import os
import ssl
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
from pathlib import Path

from packaging.utils import InvalidSdistFilename, InvalidWheelFilename, parse_sdist_filename, parse_wheel_filename
from packaging.version import InvalidVersion, Version
from pip._internal.models.index import PyPI

COLUMNS = ("package", "version", "released", "newest", "newest_released")
AUDIT = [
    sys.executable,
    "-m",
    "pip_audit",
    "--no-deps",
    "--disable-pip",
    "--progress-spinner",
    "off",
    "--format",
    "json",
]
FOUND, UNKNOWN = 1, 3
PATIENCE_S = 600
"""Time after which pip-audit's silence counts as no answer."""


def pins(text: str) -> dict[str, str]:
    """Return version by name of lines NAME==VERSION; comments and empty lines do not count."""
    lines = (line.strip() for line in text.splitlines())
    return dict(line.split("==", 1) for line in lines if line and not line.startswith("#"))


def vulnerabilities(packages: dict[str, str], command: list[str]) -> list[str] | str:
    """Return one line for each known vulnerability of these versions, or, as text, why pip-audit has no answer."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        file.writelines(f"{name}=={version}\n" for name, version in packages.items())
        file.flush()
        try:
            done = subprocess.run(
                [*command, "--requirement", file.name], capture_output=True, text=True, timeout=PATIENCE_S
            )
        except subprocess.TimeoutExpired:
            return f"it said nothing within {PATIENCE_S} s"
    try:
        told = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError, TypeError):
        return (done.stderr.strip().splitlines() or ["it said nothing"])[-1][:200]
    skipped = [item for item in told if "vulns" not in item]
    if skipped or len(told) != len(packages):
        return f"it answered for {len(told) - len(skipped)} of {len(packages)} packages"
    return [f"{item['name']} {item['version']}: {found['id']}" for item in told for found in item["vulns"]]


def dates(page: dict) -> dict[Version, str]:
    """Return the day of the first upload of every version that an index's page lists; yanked files do not count."""
    found: dict[Version, str] = {}
    for file in page.get("files", []):
        name, day = file["filename"], file.get("upload-time", "")[:10]
        try:
            version = (parse_wheel_filename if name.endswith(".whl") else parse_sdist_filename)(name)[1]
        except (InvalidWheelFilename, InvalidSdistFilename, InvalidVersion):
            continue
        if not file.get("yanked"):
            found[version] = min(filter(None, (found.get(version), day)), default="")
    return found


def asked(name: str, index: str) -> dict:
    """Return the page of a package in an index, as JSON; an empty one where the index gives none.

    Raises: URLError where the index cannot be reached.
    """
    headers = {"Accept": "application/vnd.pypi.simple.v1+json"}
    request = urllib.request.Request(f"{index.rstrip('/')}/{name.lower().replace('_', '-')}/", headers=headers)
    trusted = ssl.create_default_context(cafile=os.environ.get("PIP_CERT"))
    try:
        with urllib.request.urlopen(request, timeout=15, context=trusted) as answer:
            return json.load(answer)
    except (urllib.error.HTTPError, ValueError):
        return {}


def row(name: str, version: str, page: dict) -> dict[str, str]:
    """Return a row of COLUMNS from the page of a package."""
    known = dates(page)
    final = [entry for entry in known if not entry.is_prerelease]
    newest = max(final, default=None)
    told = {"newest": str(newest), "newest_released": known[newest]} if newest else {}
    return {"package": name, "version": version, "released": known.get(Version(version), ""), **told}


def table(packages: dict[str, str], index: str) -> list[dict[str, str]]:
    """Return the row of every pin; without an index that can be reached they hold the versions alone."""
    rows, there = [], True
    for name, version in packages.items():
        page: dict = {}
        if there:
            try:
                page = asked(name, index)
            except urllib.error.URLError:
                there = False
        rows.append(row(name, version, page))
    return rows


def main(arguments: list[str], command: list[str] = AUDIT) -> int:
    """Audit, or write the table; return the status. command: pip-audit's, without the file of requirements."""
    options = argparse.ArgumentParser(description="Hold the pins against the known vulnerabilities.")
    options.add_argument("--pins", type=Path, required=True, help="file of lines NAME==VERSION")
    options.add_argument("--out", type=Path, required=True, help="table (.csv), where pip-audit has no answer")
    options.add_argument("--only", nargs="+", help="packages to ask about (default: all pins)")
    given = options.parse_args(arguments)
    packages = pins(given.pins.read_text())
    packages = {name: packages[name] for name in given.only or packages}
    found = vulnerabilities(packages, command)
    if isinstance(found, list):
        print("\n".join(found) or f"{len(packages)} pins, no known vulnerability")
        return FOUND if found else 0
    rows = table(packages, os.environ.get("PIP_INDEX_URL", PyPI.simple_url))
    with given.out.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    dated = sum(bool(entry["released"]) for entry in rows)
    print(
        f"pip-audit has no answer here ({found}); {given.out}: {len(rows)} versions, {dated} with dates",
        file=sys.stderr,
    )
    return UNKNOWN


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
