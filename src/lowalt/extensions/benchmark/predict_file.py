"""A user's own method as a Python file that answers, for a confirmed result.

The file and what it reads are frozen.
The file names the track and part that it trained on, and every file that it reads:

    TRAINED_ON = "unseen", "train"
    FILES = ["mine.pkl"]

    def predict(signals, images): ...

`FILES` are paths as seen from the file's folder. `predict` takes signals (n, stations, 400)
complex64 and images (n, stations * 3, 24, 24) uint8 as `lowalt.extensions.benchmark.load` gives
them, and returns probabilities (n, classes). It runs in the user's own process with the user's
rights: it can do whatever a program of the user can do.
"""

import ast
import hashlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from lowalt.files.atomic import sha256, text_of
from lowalt.files.errors import InputError, in_one_line, shown

Predict = Callable[[np.ndarray, np.ndarray], np.ndarray]
SYSTEM = ("/usr", "/lib", "/lib64", "/etc", "/proc", "/sys", "/dev")
"""Folders that hold no file of a user."""


class PredictFile:
    """A frozen file: `trained_on`, the (track, part) that it states, and `checksums`.

    The checksums are those of the file and of all that it reads.
    """

    def __init__(self, path: str | Path) -> None:
        """Read what the file states, and freeze it; none of its code runs.

        Raises: InputError where the file or one that it names is missing, or a statement is missing
        or wrong.
        """
        self.path = Path(path)
        stated = _stated(self.path)
        self.trained_on = stated["TRAINED_ON"]
        names = [self.path.name, *stated["FILES"]]
        for name in names:
            if not (self.path.parent / name).is_file():
                raise InputError(
                    f"{self.path}: FILES names {shown(name)}, which is not a file next to it"
                )
        self._frozen = {(self.path.parent / name).resolve() for name in names}
        lines = [f"{sha256(self.path.parent / name)}  {name}\n" for name in names]
        self.checksums = "".join(lines).encode()

    @property
    def sha256(self) -> str:
        """SHA-256 of the checksums, as `sha256sum predict.py FILES | sha256sum` prints it."""
        return hashlib.sha256(self.checksums).hexdigest()

    def answers(self, signals: np.ndarray, images: np.ndarray) -> np.ndarray:
        """Run the file and return what its function `predict` answers.

        Raises: InputError where the file has no such function, reads a file that it does not name,
        ends in an error, or answers a sample differently when it is alone.
        """
        with self._watched():
            predict = _loaded(self.path)
            every = _array(predict(signals, images), self.path)
            for number in range(0, len(signals), max(1, len(signals) // 3)):
                one = slice(number, number + 1)
                alone = _array(predict(signals[one], images[one]), self.path)
                if alone.shape != every[one].shape or not np.allclose(alone, every[one], atol=1e-3):
                    raise InputError(
                        f"{self.path}: predict answers sample {number} differently when it is "
                        "alone, expected answers that depend on their own sample only"
                    )
        return every

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Refuse every file opened for reading that is not frozen, of Python or of a library."""
        libraries = {sys.prefix, sys.base_prefix, *filter(None, sys.path), *SYSTEM}
        roots = tuple(Path(folder).resolve() for folder in libraries)
        watching = [True]
        unnamed = []

        def opened(event: str, details: tuple) -> None:
            """Note a file of the user that is not frozen."""
            if not watching or event != "open" or not isinstance(details[0], (str, bytes, Path)):
                return
            path = Path(_text(details[0])).resolve()
            mode = details[1] or "r"
            below = any(path.is_relative_to(root) for root in roots)
            if (
                below
                or path in self._frozen
                or not mode.startswith("r")
                or "__pycache__" in path.parts
            ):
                return
            if path.is_file():
                unnamed.append(path)
                raise PermissionError(f"{path} is not among FILES")

        sys.addaudithook(opened)
        folder = str(self.path.resolve().parent)
        kept = list(sys.path)
        sys.path.insert(0, folder)
        try:
            yield
        except InputError:
            raise
        except (Exception, SystemExit) as error:
            if not unnamed:
                raise InputError(
                    f"{self.path}: {type(error).__name__}: {in_one_line(error)}"
                ) from error
        finally:
            watching.clear()
            sys.path[:] = kept
            _forget_modules_of(folder)
        if unnamed:
            raise InputError(
                f"{self.path}: reads {unnamed[0]}, which its FILES does not name, so it is not "
                "frozen"
            )


def _forget_modules_of(folder: str) -> None:
    """Let modules of a folder be read again when they are next imported."""
    for name, module in list(sys.modules.items()):
        source = getattr(module, "__file__", None)
        if source and Path(source).resolve().parent == Path(folder):
            del sys.modules[name]


def _text(path: str | bytes | Path) -> str:
    """A path as text."""
    if isinstance(path, bytes):
        return path.decode(errors="replace")
    return str(path)


def _stated(path: Path) -> dict:
    """The statements TRAINED_ON and FILES of a file, read without running it.

    Raises: InputError where one is missing or wrong.
    """
    try:
        tree = ast.parse(text_of(path, "file of predictions"))
    except SyntaxError as error:
        raise InputError(f"{path}: not a Python file ({in_one_line(error)})") from error
    found: dict = {"FILES": []}
    for node in tree.body:
        if not isinstance(node, ast.Assign) or not isinstance(node.targets[0], ast.Name):
            continue
        name = node.targets[0].id
        if name in ("TRAINED_ON", "FILES"):
            try:
                found[name] = ast.literal_eval(node.value)
            except ValueError:
                raise InputError(
                    f"{path} line {node.lineno}: {name} is computed, expected it written out"
                ) from None
    trained_on = found.get("TRAINED_ON")
    if (
        not isinstance(trained_on, tuple)
        or len(trained_on) != 2
        or not all(isinstance(one, str) for one in trained_on)
    ):
        raise InputError(
            f"{path}: does not state what it trained on, expected a line "
            'TRAINED_ON = "TRACK", "train"'
        )
    if not isinstance(found["FILES"], list) or not all(
        isinstance(one, str) for one in found["FILES"]
    ):
        raise InputError(
            f"{path}: FILES is {shown(found['FILES'])}, expected a list of names of files"
        )
    return found


def _loaded(path: Path) -> Predict:
    """The function `predict` of a file, which is run. Raises: InputError where it has none."""
    spec = importlib.util.spec_from_file_location("lowalt_own_predictions", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: not a Python file, expected a name that ends in .py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    predict = getattr(module, "predict", None)
    if not callable(predict):
        raise InputError(f"{path}: has no function predict(signals, images)")
    return predict


def _array(answers: object, path: Path) -> np.ndarray:
    """Answers as an array (n, classes). Raises: InputError for anything else."""
    try:
        return np.asarray(answers, float)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path}: predict returns no array of numbers ({in_one_line(error)})"
        ) from error
