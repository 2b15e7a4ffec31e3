"""Cost of an image sample: signal -> spectra -> tile -> PNG -> tar, ours next to the usual ways, on
the same samples.

    python benchmarks/images.py --run results/default --samples 300 --out
    results/benchmarks/images.csv

One core, one process, processor time: the least of five passes over a sample, averaged over the
samples (other work on the machine only ever adds). Samples are drawn evenly from all noisy signals
of the run. Every method's PNG is decoded by Pillow and its RGB pixels compared with the tile it
came from; bytes are compared with a second encoding.
"""

import argparse
import io
import os
import tarfile
import tempfile
import time
from pathlib import Path

# One core: BLAS threads would spin, and count as processor time. Read when numpy is imported.
os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import deflate
import matplotlib
import numpy as np
import scipy.signal
import yaml
from PIL import Image
from zlib_ng import zlib_ng

from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe
from lowalt.shards.tar import Writer
from lowalt.spectra import Spectra
from lowalt.tiles import Images, Renderer, Scale, encode, paint
from lowalt.tiles.png import apply_paeth, packed

FLOORS_DB = (20.0, 25.0, 30.0, 35.0, 40.0)
SCALES = [
    Scale("linear"),
    Scale("power", gamma=0.5),
    *(Scale("decibel", floor) for floor in FLOORS_DB),
]
COLUMNS = (
    "method",
    "scale",
    "samples",
    "spectra_ms",
    "encode_ms",
    "tar_ms",
    "total_ms",
    "kilobytes",
    "pixels_exact",
    "bytes_repeat",
    "pixels_off_usual_percent",
    "largest_off_usual",
    "hardware",
)


def load(run: Path, count: int) -> tuple[Network, Spectra, np.ndarray]:
    """Network and spectra of a run and `count` of its samples, (count, stations, symbols), evenly
    spaced.
    """
    config = yaml.safe_load((run / "config.yaml").read_text())
    files = [np.load(path, mmap_mode="r") for path in sorted((run / "noisy").glob("*.npy"))]
    ends = np.cumsum([0, *(file.shape[0] * file.shape[1] for file in files)])
    numbers = np.linspace(0, ends[-1] - 1, min(count, ends[-1])).astype(int)
    samples = []
    for number in numbers:
        place = int(np.searchsorted(ends, number, side="right")) - 1
        samples.append(files[place].reshape(-1, *files[place].shape[2:])[number - ends[place]])
    return (
        Network.from_settings(config["network"]),
        Spectra.from_settings(config["spectra"]),
        np.array(samples),
    )


def usual_values(
    signal: np.ndarray, carrier_hz: float, network: Network, spectra: Spectra
) -> list[np.ndarray]:
    """VRP, TRP and VT as one would first write them: scipy's STFT, and a matrix product for the
    matched speeds.
    """
    values = []
    for setting in (spectra["vrp"], spectra["trp"]):
        _, _, found = scipy.signal.stft(
            signal,
            window="boxcar",
            nperseg=setting.window,
            noverlap=setting.window - setting.hop,
            nfft=setting.points,
            return_onesided=False,
            boundary=None,
            padded=False,
        )
        values.append(np.abs(np.fft.fftshift(found, axes=0))[:, :-1])
    length = spectra["vt"].window
    segments = np.lib.stride_tricks.sliding_window_view(signal, length + 1)[: len(signal) - length]
    phase = 4 * np.pi * carrier_hz * network.symbol_interval_s / SPEED_OF_LIGHT
    matched = np.exp(1j * phase * np.outer(spectra["vt"].speeds_mps, np.arange(length + 1)))
    short = matched[:, :length] @ segments[:, :length].T
    longer = matched @ segments.T
    values.append(np.abs(longer * length / (length + 1)) ** 2 - np.abs(short) ** 2)
    return values


def usual_tile(signals: np.ndarray, network: Network, spectra: Spectra, scale: Scale) -> np.ndarray:
    """A decibel tile of index values the usual way: float64 spectra, Pillow's resize, numpy's
    logarithm.
    """
    rows = []
    for station, signal in zip(network.stations, signals, strict=True):
        images = []
        for view, values in enumerate(usual_values(signal, station.frequency_hz, network, spectra)):
            picture = Image.fromarray(values[::-1].astype(np.float32)).resize(
                (256, 256), Image.Resampling.BILINEAR
            )
            x = np.asarray(picture)
            x = x / (np.abs(x).max() or 1)
            y = np.maximum(0, 1 + 20 * np.log10(np.maximum(np.abs(x), 1e-12)) / scale.floor_db)
            steps = np.floor((127 if view == 2 else 255) * y + 0.5).astype(int)
            images.append((128 + np.sign(x) * steps if view == 2 else steps).astype(np.uint8))
        rows.append(np.hstack(images))
    return np.vstack(rows)


def usual_png(tile: np.ndarray, colours: str) -> bytes:
    """RGB PNG at Pillow's default level of 6, coloured by matplotlib."""
    pixels = matplotlib.colormaps[colours](tile, bytes=True)[..., :3]
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()


def pillow_palette_png(tile: np.ndarray, palette: np.ndarray) -> bytes:
    """Palette PNG at Pillow's level 1."""
    picture = Image.fromarray(tile)
    picture.putpalette(palette.tobytes())
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", compress_level=1)
    return buffer.getvalue()


def libdeflate_png(tile: np.ndarray, palette: np.ndarray, kind: int) -> bytes:
    """Palette PNG with libdeflate at level 1 behind the sub (1) or Paeth (4) filter."""
    rows = np.empty((tile.shape[0], tile.shape[1] + 1), np.uint8)
    if kind == 4:
        apply_paeth(tile, rows)
    else:
        rows[:, 0], rows[:, 1] = kind, tile[:, 0]
        np.subtract(tile[:, 1:], tile[:, :-1], out=rows[:, 2:])
    return packed(tile.shape, palette, bytes(deflate.zlib_compress(rows, 1)))


def zlib_ng_png(tile: np.ndarray, palette: np.ndarray) -> bytes:
    """Palette PNG with zlib-ng behind the Paeth filter, its Huffman codes only: no strings are
    looked for.
    """
    rows = np.empty((tile.shape[0], tile.shape[1] + 1), np.uint8)
    apply_paeth(tile, rows)
    coder = zlib_ng.compressobj(1, zlib_ng.DEFLATED, 15, 9, zlib_ng.Z_HUFFMAN_ONLY)
    return packed(tile.shape, palette, coder.compress(rows.tobytes()) + coder.flush())


def least(function, *arguments, repeats: int = 5) -> tuple[object, float]:
    """Result of a call and its least processor time (ms)."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        result = function(*arguments)
        best = min(best, time.process_time() - start)
    return result, 1e3 * best


def into_tar(folder: Path, usual: bool):
    """A function that appends one PNG and a record of 1.5 kB to a tar in `folder`, our way or
    tarfile's.
    """
    record = b"{}".ljust(1500)
    if not usual:
        writer = Writer((folder / "ours.tar").open("wb"))
        return lambda png: writer.add("sample", record, "png", png)
    archive = tarfile.open(folder / "usual.tar", "w")  # noqa: SIM115

    def add(png: bytes) -> None:
        """Append the record and the PNG to the archive."""
        for name, data in (("sample.json", record), ("sample.png", png)):
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))

    return add


def measure(name: str, scale: Scale, samples, render, code, tar, palette) -> dict:
    """One row: times and bytes of a method over all samples, and whether Pillow gives its pixels
    back.
    """
    times = []
    sizes = []
    exact = True
    repeat = True
    for signals in samples:
        tile, first = least(render, signals)
        png, second = least(code, tile)
        _, third = least(tar, png)
        times.append((first, second, third))
        sizes.append(len(png))
        with Image.open(io.BytesIO(png)) as picture:
            exact &= bool((np.asarray(picture.convert("RGB")) == paint(tile, palette)).all())
        repeat &= code(tile) == png
    parts = np.mean(times, axis=0)
    text = f"{scale.name} {scale.floor_db:g}" if scale.name == "decibel" else scale.name
    return dict(
        method=name,
        scale=text,
        samples=len(samples),
        spectra_ms=parts[0],
        encode_ms=parts[1],
        tar_ms=parts[2],
        total_ms=parts.sum(),
        kilobytes=np.mean(sizes) / 1e3,
        pixels_exact=exact,
        bytes_repeat=repeat,
    )


def main() -> None:
    """Measure all methods and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "--run", type=Path, required=True, help="a run's folder with config.yaml and noisy/*.npy"
    )
    options.add_argument("--samples", type=int, default=300)
    options.add_argument(
        "--usual-samples", type=int, default=40, help="samples for the slow usual way"
    )
    options.add_argument(
        "--scale-db",
        type=float,
        default=30.0,
        help="decibel floor that the methods are compared at",
    )
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    network, spectra, samples = load(given.run, given.samples)
    few = samples[:: max(1, len(samples) // given.usual_samples)]
    common = Scale("decibel", given.scale_db)
    rows = []
    with tempfile.TemporaryDirectory(
        dir=given.out.parent if given.out.parent.is_dir() else None
    ) as name:
        folder = Path(name)
        ours = into_tar(folder, usual=False)
        usual = into_tar(folder, usual=True)
        for scale in SCALES:
            images = Images(256, scale)
            tiles = Renderer(network, spectra, images)
            palette = images.palette
            rows.append(
                measure(
                    "ours",
                    scale,
                    samples,
                    tiles.tile,
                    lambda t, p=palette: encode(t, p),
                    ours,
                    palette,
                )
            )
        tiles = Renderer(network, spectra, Images(256, common))
        palette = tiles.images.palette
        for label, code in {
            "ours, on the samples of the rows below": lambda t: encode(t, palette),
            "our tile, palette PNG, sub, libdeflate 1": lambda t: libdeflate_png(t, palette, 1),
            "our tile, palette PNG, Paeth, libdeflate 1": lambda t: libdeflate_png(t, palette, 4),
            "our tile, palette PNG, Paeth, zlib-ng Huffman only": lambda t: zlib_ng_png(t, palette),
            "our tile, palette PNG, Pillow 1": lambda t: pillow_palette_png(t, palette),
        }.items():
            rows.append(measure(label, common, few, tiles.tile, code, ours, palette))
        render = lambda signals: usual_tile(signals, network, spectra, common)  # noqa: E731
        code = lambda tile: usual_png(tile, "viridis")  # noqa: E731
        rows.append(
            measure(
                "usual: scipy STFT, Pillow, RGB PNG 6", common, few, render, code, usual, palette
            )
        )
        off = np.array([np.abs(render(s).astype(int) - tiles.tile(s)) for s in few])
        rows[-1]["pixels_off_usual_percent"], rows[-1]["largest_off_usual"] = (
            100 * (off > 0).mean(),
            off.max(),
        )
    table = [
        {key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()}
        | {"hardware": describe()}
        for row in rows
    ]
    for row in table:
        print(*list(row.values())[:10], sep="  ")
    write_csv(given.out, COLUMNS, table)


if __name__ == "__main__":
    main()
