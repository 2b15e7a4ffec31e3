"""Training metrics for TensorBoard, where a run asks for them; history.csv has the same numbers without it."""

from collections.abc import Callable
from pathlib import Path

from lowalt.files.errors import InputError

Metrics = Callable[[int, dict[str, float]], None]


def tensorboard(folder: str | Path, first: int) -> Metrics:
    """Return a function (step, {name: value}) that appends to event files in `folder`.

    first: the step that the run starts from; entries of an earlier, killed run after it are removed.
    Raises: InputError where the package is not installed.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError as error:
        raise InputError(
            f"recognition.tensorboard: the package tensorboard is not installed ({error}); "
            "expected `pip install 'lowalt[tensorboard]'`, or recognition.tensorboard: false"
        ) from error
    writer = SummaryWriter(str(folder), purge_step=first)

    def write(step: int, values: dict[str, float]) -> None:
        """Append the values of one step and write them to disk."""
        for name, value in values.items():
            writer.add_scalar(name, value, step)
        writer.flush()

    return write
