"""The record of a recording: a short YAML file with the facts that the samples do not hold.

Its keys stand in the definition `recording` of `lowalt/config/brought.schema.yaml`, each with its
unit and meaning.
"""

from dataclasses import dataclass
from pathlib import Path

from lowalt.config.schema import check_brought, of_brought, with_numbers
from lowalt.files.errors import InputError
from lowalt.files.inside import inside
from lowalt.files.yaml_files import load_yaml


@dataclass(frozen=True)
class Record:
    """One recording: the keys of a record, `file` with its folder, None where left out."""

    file: Path
    carrier_hz: float
    channel: str
    rate_hz: float | None = None
    columns: tuple[int | str, ...] | None = None
    variable: str | None = None
    times: str | None = None
    label: str | None = None
    moves: str | None = None
    layout: str | None = None
    dtype: str | None = None
    trust: str | None = None
    source: str | None = None
    licence: str | None = None
    capture: int | None = None
    receiver: int = 0
    chirps: dict | None = None
    twin: dict | None = None
    empty_s: list[float] | None = None

    @property
    def name(self) -> str:
        """The recording's name: its file's, without the suffix."""
        return self.file.stem

    @property
    def recorded(self) -> bool:
        """Whether the record names a recording; that of a radar without one is its own file."""
        return self.file.suffix.lower() != ".yaml"


def record(block: dict, folder: Path, where: str) -> Record:
    """Return the record in a mapping; its file and its own targets are relative to `folder`.

    Raises: InputError naming `where`, the key, its value and what was expected; also for a file
    outside of the folder.
    """
    block = with_numbers(
        {key: value for key, value in block.items() if value is not None}, of_brought("recording")
    )
    check_brought("recording", block, where)
    if "file" not in block and not {"twin", "rate_hz"} <= set(block):
        raise InputError(
            f"{where}: missing key(s) ['file'], expected it, or twin and rate_hz of a radar without"
            " any recording"
        )
    columns = tuple(block.get("columns", ()))
    if block["channel"] == "real":
        for key in ("moves", "layout", "chirps"):
            if key in block:
                raise InputError(
                    f"{where}: {key} is {block[key]!r}, expected channel 'complex' with it: a real "
                    "channel has no sign of Doppler and no second part"
                )
        if len(columns) > 1:
            raise InputError(
                f"{where}: columns is {list(columns)}, expected one for channel 'real'"
            )
    hertz = {key: float(block[key]) for key in ("carrier_hz", "rate_hz") if key in block}
    if "targets" in block.get("twin", {}):
        block["twin"] = {
            **block["twin"],
            "targets": [
                str(inside(folder, name, where, "twin.targets"))
                for name in block["twin"]["targets"]
            ],
        }
    file = inside(folder, block["file"], where) if "file" in block else Path(where)
    if file.suffix == ".sigmf-meta":
        inside(folder, str(Path(block["file"]).with_suffix(".sigmf-data")), where)
    return Record(**{**block, **hertz, "file": file, "columns": columns or None})


def read_record(path: str | Path) -> Record:
    """Return the record in a YAML file.

    Raises: InputError naming the file, the key, its value and what was expected.
    """
    path = Path(path)
    return record(load_yaml(path, "record of a recording"), path.parent, str(path))
