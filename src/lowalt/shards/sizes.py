"""Bytes of a sample in a shard, by the kind of shards."""

from tarfile import BLOCKSIZE

from lowalt.config.blocks import snrs_of
from lowalt.config.network import band

RECORD_BYTES = 2048
"""Bytes of a sample's JSON record in the tar, including padding."""
PIXEL_BYTES = 0.5
"""Largest measured number of bytes in a shard per pixel of a tile."""
CELL_BYTES = {"complex64": 8, "int16": 4}
"""Bytes of a range cell of a cube, by the type that it is stored as."""
SYMBOL_BYTES = 8
"""Bytes of a symbol of a signal, complex64."""
HEADER_BYTES = 128
"""Bytes before the data of a file in NumPy's format."""
TRUTH_BYTES = 65
"""Bytes of the record per symbol of a cube, for its ground truth: the chosen cell and the numbers
`cube.TRUTH`.
"""


def cell_type(config: dict) -> str:
    """Return the type in which range cells of cubes are stored: "complex64" or "int16"."""
    return config["shards"].get("cells", "complex64")


def sample_bytes(config: dict) -> int:
    """Return the approximate bytes of a sample in a shard, padding included, by the kind of shards.

    The samples of a motion model share the file of a recipe, of which each counts its share.
    """
    kind = config["shards"]["kind"]
    stations = len(config["network"]["stations"])
    symbols = stations * config["network"]["symbols"]
    record = RECORD_BYTES
    if kind == "image":
        spectra = sum(isinstance(block, dict) for block in config["spectra"].values())
        pixels = stations * spectra * config["images"]["size"] ** 2
        data = int(PIXEL_BYTES * pixels)
    elif kind == "cube":
        record += TRUTH_BYTES * symbols
        cells = symbols * band(config["network"])["subcarriers"]
        data = HEADER_BYTES + CELL_BYTES[cell_type(config)] * cells
    else:
        data = HEADER_BYTES + SYMBOL_BYTES * symbols
    # Each of the two files in the tar follows a header of one block.
    whole = 2 * BLOCKSIZE + _padded(record) + _padded(data)
    if kind == "recipe":
        return whole // len(snrs_of(config))
    return whole


def _padded(size: int) -> int:
    """Return the bytes of a file's data in a tar, which end with a whole block."""
    return size + -size % BLOCKSIZE
