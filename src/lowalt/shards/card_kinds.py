"""Sentences of the data card about each kind of shards.

WHAT and READING leave the numbers of stations and spectra, and the names of the spectra, to `str.format`.
"""

WHAT = {
    "image": "{stations} x {columns} tiles of time-frequency images",
    "signal": "complex symbol-domain signals",
    "cube": "all range cells of every symbol, complex, with noise",
    "recipe": "clean complex symbol-domain echoes, to which lowalt adds the noise of each sample",
}
"""Name of the data in the description."""

_SAMPLE = """\
Each shard is a plain tar in the WebDataset layout. A sample has two members:

- `KEY.{extension}`: {meaning};
- `KEY.json`: class, subtype, motion parameters, what each station sees, SNR, seed, versions.
"""

READING = {
    "image": _SAMPLE.format(
        extension="png",
        meaning="the tile, 8-bit indices with their colour map; rows are the stations, columns {spectra}",
    ),
    "signal": _SAMPLE.format(
        extension="npy",
        meaning="the noisy signals, float32 (stations, symbols, 2: real and imaginary part), which make the tiles",
    ),
    "cube": _SAMPLE.format(
        extension="cube.npy",
        meaning="the range cells of every symbol with noise, float32 (stations, symbols, cells, 2: real and imaginary "
        "part), or int16 to be multiplied by the station's `step` in the record's `cube`, rounded by at most half a "
        "step; the record's `cube` tells at every symbol the cell that the receiver chose (-1: none received), which "
        "holds the signal, and the target's true range, radial speed, direction and cell",
    ),
    "recipe": """\
Each shard is a plain tar in the WebDataset layout. A motion model, with the samples of all its SNRs, has two members:

- `KEY.clean.npy`: its echoes without noise, float32 (stations, symbols, 2: real and imaginary part);
- `KEY.json`: class, subtype, motion parameters, what each station sees, the SNRs (infinite where `noise` is
  false), seed, versions.

The noise of a sample follows from seed, subtype, motion model, station and SNR. lowalt adds it while it reads:
`ShardSet` below gives the signals and images of the other kinds of shards, equal in every byte, and
`webdataset.WebDataset(PATH, shardshuffle=False).compose(lowalt.shards.clean.samples)` gives the samples of signal
shards. A tool without lowalt reads the clean echoes and can add noise of its own.
""",
}
"""How a shard is read."""
