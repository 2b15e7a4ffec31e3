"""The manifest of a report: the paths of all tables, pictures and measurements of a run.

It is a JSON object that maps names to files, for example

    {"accuracy": "results/default/accuracy.csv", "clouds": ["results/default/clouds/crow.npz", ...],
    ...}

Paths are relative to the folder in which the report is made. The workflow writes the manifest of a
run.
"""

from pathlib import Path
from typing import Any

from lowalt.files.atomic import existing
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.files.json_objects import read_object

FILES = (
    "accuracy",
    "confusion_by_snr",
    "subtypes",
    "comparisons",
    "orderings",
    "seeds",
    "distances",
    "index",
)
"""Names that every manifest has, with one file each."""
LISTS = ("clouds", "benchmarks")
"""Names that every manifest has, with a list of files each."""
KEPT = {"accuracy_cost": "default-accuracy_cost.csv", "echo_cost": "default-cost.csv"}
"""Tables in results/reference that the page shows if the run has none: file by the name of the
run's table.
"""
OPTIONAL = (
    "published",
    "predictions",
    "transfer",
    "benchmark",
    *KEPT,
    *(f"kept_{name}" for name in KEPT),
)
"""Optional names; without the file or files, the page has no such section."""


class Inputs:
    """The files of a manifest by their names."""

    def __init__(self, files: dict[str, Any], source: str = "manifest") -> None:
        """files: path or list of paths by name; source: the manifest's own path, for messages.

        Raises: InputError for names that are missing or unknown.
        """
        missing = sorted({*FILES, *LISTS} - set(files))
        unknown = sorted(set(files) - {*FILES, *LISTS, *OPTIONAL})
        if missing or unknown:
            raise InputError(
                f"{source}: missing {missing}, unknown {unknown}, optional are {OPTIONAL}"
            )
        self.files = files

    @classmethod
    def read(cls, path: str | Path) -> "Inputs":
        """Read a manifest.

        Raises: InputError where it is missing or no JSON object, or as the constructor says.
        """
        return cls(read_object(path, "a manifest"), str(path))

    def __contains__(self, name: str) -> bool:
        """Whether the run or the kept references have this file."""
        return name in self.files

    def own_or_kept(self, name: str) -> str | None:
        """Return the manifest's name of this run's file, else of the kept one, else None."""
        return next((known for known in (name, f"kept_{name}") if known in self), None)

    def path(self, name: str) -> Path:
        """Return the file called `name`. Raises: InputError where it does not exist."""
        return existing(self.files[name], name)

    def paths(self, name: str) -> list[str]:
        """Return the list of files called `name`, none where the manifest leaves it out."""
        return self.files.get(name, [])

    def table(self, name: str, *columns: str) -> list[dict[str, str]]:
        """Return the rows of the table called `name`.

        Raises: InputError where it lacks one of `columns`.
        """
        return read_csv(self.files[name], *columns)
