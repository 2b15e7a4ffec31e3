"""Outcomes of faults kept in a file, a line each, so that a run goes on where the last one stopped."""

import hashlib
import json
from collections.abc import Callable, Iterable
from pathlib import Path

from mutation.candidates import Mutant
from mutation.trials import Outcome


def _digest(*parts: str) -> str:
    """A short text that is another for other parts."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


class Kept:
    """Outcomes in the file `path`, known by the source that the fault is set into.

    A killed fault is known while its source stays. A survivor is known while the tests shown to it stay as well, so a
    test that is added has it tried again.
    """

    def __init__(self, path: Path, root: Path) -> None:
        """path: made where it is missing; root: of the repository whose sources the faults are set into."""
        self.path, self.root = path, root
        self.rows: dict[str, dict] = {}
        self.once: set[str] = set()
        if path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                row = json.loads(line)
                if row.get("survived"):
                    self.once.add(row["fault"])
                else:
                    self.rows[row["fault"]] = row

    def _fault(self, mutant: Mutant) -> str:
        """The name of a fault in the source as it stands now."""
        return _digest(*map(str, mutant), (self.root / mutant.file).read_text(encoding="utf-8"))

    def _tests(self, tests: list[str]) -> str:
        """The name of tests with the files they stand in."""
        files = sorted({test.partition("::")[0] for test in tests})
        return _digest(*tests, *((self.root / file).read_text(encoding="utf-8") for file in files))

    def survived_once(self, mutant: Mutant) -> bool:
        """Whether the fault survived a trial, be it killed now by a test that was added."""
        return self._fault(mutant) in self.once

    def outcome(self, mutant: Mutant, tests: list[str]) -> Outcome | None:
        """The kept outcome, None where the fault is not known."""
        row = self.rows.get(self._fault(mutant))
        if row is None or not (row["killed"] or row["shown"] == self._tests(tests)):
            return None
        return Outcome(mutant, row["killed"], row["tests"], row["late"], row.get("undecided", False))

    def of(self, mutant: Mutant, tests: list[str], try_it: Callable[[], Outcome]) -> Outcome:
        """The kept outcome, or that of a trial, which is kept."""
        found = self.outcome(mutant, tests)
        if found is None:
            found = try_it()
            row = {"fault": self._fault(mutant), "shown": self._tests(tests), **found._asdict()}
            self.rows[row["fault"]] = row
            self._add(row)
        return found

    def note(self, mutants: Iterable[Mutant]) -> None:
        """Keep that these faults survived all tests shown to them, in every look."""
        for fault in map(self._fault, mutants):
            if fault not in self.once:
                self.once.add(fault)
                self._add({"fault": fault, "survived": True})

    def _add(self, row: dict) -> None:
        """Append a line to the file."""
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
