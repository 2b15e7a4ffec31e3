"""The height of its target that each station measures, as samples next to their images and as a cue
of the network.

height = height of the station + R (Omega + e)
    R      range, the centre m c / (2 M df) of the cell m = round(r / cell) mod M nearest to the
    target at the first
           symbol; the data do not keep the cell that each symbol's echo took
    Omega  sine of the elevation, the target's direction cosine along the array's vertical axis
    e      normal error; its variance is the Cramer-Rao bound of the receive array; the sum stays
    within -1..1

The bound: V elements of a column receive x_v[n] = s[n] exp(j psi v) + noise, psi = pi kappa Omega
for elements half a wavelength of the carrier apart, in each of N symbols; the amplitudes s[n] are
unknown, the noise is white and independent from element to element. The Fisher information of psi
is 2 N eta H sum (v - mean v)^2, with eta the SNR of one element and H columns that add up in phase;
the sum is V (V^2 - 1) / 12, and H V eta is the SNR after beamforming, which is that of the data's
signals. So var psi >= 6 / (SNR N (V^2 - 1)).
Assumed: one point on the beam's axis for the whole look, calibrated arrays, no reflection by the
ground, an estimate that reaches the bound. Sources: Kay, Fundamentals of Statistical Signal
Processing: Estimation Theory, 1993, ch. 3 (bearing); Van Trees, Optimum Array Processing, 2002, ch.
8.
"""

import hashlib
import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import nn

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.files.atomic import replacing, sha256
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.streams import stream
from lowalt.recognition.fusion import FUSIONS, AttentionFusion
from lowalt.recognition.recogniser import Recogniser
from lowalt.recognition.samples import Samples
from lowalt.recognition.schemes import SPECTRA, Scheme
from lowalt.shards import ShardSet
from lowalt.shards.sample_record import row_of
from lowalt.tiles import colour_map

SCALE_M = 50.0
"""Height that enters the network as 1: targets on the ground are near 0, craft near 1 to 3."""
HIDDEN = 16
"""Values between the two linear layers of the cue."""


def elevation_error(network: Network, station: Station, snr_db: float) -> float:
    """Return the standard deviation of a measured direction cosine Omega at an SNR (dB) after
    beamforming; 0 at +inf.

    Raises: InputError for a receive array of one row, which measures no elevation.
    """
    rows = network.receive[1]
    if rows < 2:
        raise InputError(
            f"heights: receive_array {network.receive} has {rows} row, expected two or more for a"
            " height"
        )
    if snr_db == math.inf:
        return 0.0
    snr = float(portable.exp(snr_db * (portable.LN_10 / 10)))
    phase = math.sqrt(6 / (snr * network.symbols * (rows**2 - 1)))
    return phase / (math.pi * station.frequency_hz / network.carrier_hz)


def measured_height_m(
    network: Network, station: Station, range_m: float, omega: float, error: float = 0.0
) -> float:
    """Return the height (m) that a station measures of a target at a range (m) and direction cosine
    Omega; error: of the measured Omega. Range comes from the cell, whose number repeats after the
    unambiguous range."""
    cell_m = SPEED_OF_LIGHT / (2 * network.subcarriers * network.subcarrier_spacing_hz)
    cell = round(range_m / cell_m) % network.subcarriers
    return station.position_m[2] + cell * cell_m * min(max(omega + error, -1.0), 1.0)


def heights_m(entry: dict, network: Network) -> list[float]:
    """Return the heights (m) that the stations measure of a sample; entry: its record.

    Errors are drawn by the record's random seed, its key and the station's name alone.
    """
    _, snr_db = row_of(entry)
    found = []
    for station in network.stations:
        seen = entry["geometry"][station.name]
        spread = elevation_error(network, station, snr_db)
        error = 0.0
        if spread:
            error = (
                spread
                * stream(
                    entry["seed"], "track-height", entry["key"], station.name
                ).standard_normal()
            )
        found.append(measured_height_m(network, station, seen["range_m"], seen["omega"], error))
    return found


def of_run(folder: Path) -> dict[str, np.ndarray]:
    """Return the heights (stations,) float32 (m) of all samples of a finished run by key; measured
    once, then kept.

    Raises: InputError for a scene with effects or links, of which a measured height knows nothing.
    """
    index = folder / "shards/index.json"
    kept = folder / f"heights-{sha256(index)[:16]}.npz"
    if not kept.is_file():
        shards = ShardSet(index, check=False)
        network = Network.from_settings(shards.index["render"]["network"])
        if (shards.index["echo"] or {}).get("effects") or any(
            one.transmitter is not None for one in network.stations
        ):
            raise InputError(f"{index}: a scene with effects or links, expected neither")
        found = [heights_m(shards.record(number), network) for number in range(len(shards))]
        with replacing(kept) as temporary:
            np.savez(
                temporary, key=np.char.decode(shards.keys), height_m=np.array(found, np.float32)
            )
    with np.load(kept, allow_pickle=False) as data:
        return dict(zip(data["key"].tolist(), data["height_m"], strict=True))


class WithHeight(NamedTuple):
    """Index images (B, K * V, S, S) uint8 of samples, and the height (B, K) float32 (m) that each
    station measured.

    Of tensors, it answers the calls that trainings and evaluations make.
    """

    images: torch.Tensor
    height_m: torch.Tensor

    @property
    def shape(self) -> torch.Size:
        """Shape of the images."""
        return self.images.shape

    def to(self, device: torch.device, non_blocking: bool = False) -> "WithHeight":
        """Return both on a device."""
        return WithHeight(*(part.to(device, non_blocking=non_blocking) for part in self))

    def chunk(self, count: int) -> list["WithHeight"]:
        """Return the samples in at most `count` parts, as `torch.Tensor.chunk` cuts them."""
        return [
            WithHeight(*parts) for parts in zip(*(part.chunk(count) for part in self), strict=True)
        ]


class Heights(Samples):
    """Images of samples, and next to them the heights that the scheme's stations measured."""

    def __init__(self, images: Samples, height_m: np.ndarray) -> None:
        """images: samples; height_m (samples, stations) float32 (m): of the scheme's stations."""
        self.images, self.height_m, self.facts, self.size = (
            images,
            height_m,
            images.facts,
            images.size,
        )

    def inputs(self, numbers: np.ndarray) -> WithHeight:
        """Return the images of the samples `numbers`, with their heights."""
        return WithHeight(self.images.views(numbers), self.height_m[numbers])

    def changed(self, numbers, columns, block, generator) -> WithHeight:
        """Return `inputs`, its images augmented."""
        return WithHeight(
            self.images.changed(numbers, columns, block, generator), self.height_m[numbers]
        )

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training sees of these samples, heights included."""
        return hashlib.sha256(self.images.sha256().encode() + self.height_m.tobytes()).hexdigest()


class WithCue(AttentionFusion):
    """The paper's fusion of tokens whose last one of a station is a cue: it is added to the
    station's token.
    """

    def stations(self, tokens: torch.Tensor) -> torch.Tensor:
        """Tokens (B, K, V + 1, features) -> one token a station (B, K, features)."""
        return super().stations(tokens[:, :, :-1]) + tokens[:, :, -1]


FUSIONS["attention and a cue"] = lambda width, shape, block: WithCue(width, shape[1], block)


class HeightRecogniser(Recogniser):
    """The network with heights: two linear layers that all stations share make a cue of each, so
    they stay a set.
    """

    def __init__(
        self, scheme: Scheme, block: dict, size: int, palettes: np.ndarray, classes: int
    ) -> None:
        """As `Recogniser`; the scheme's fusion is that of attention."""
        super().__init__(
            replace(scheme, fusion="attention and a cue"), block, size, palettes, classes
        )
        # Last, so that all other weights begin as in the network without it.
        self.height = nn.Sequential(
            nn.Linear(1, HIDDEN), nn.GELU(), nn.Linear(HIDDEN, self.fusion.width)
        )

    def tokens(self, inputs: WithHeight) -> torch.Tensor:
        """Images and heights -> tokens (B, K, V + 1, features), the last of each station its cue."""
        cue = self.height(inputs.height_m.unsqueeze(-1) / SCALE_M)
        return torch.cat([super().tokens(inputs.images), cue.unsqueeze(2)], dim=2)

    @staticmethod
    def mirrored(inputs: WithHeight) -> WithHeight:
        """Return the target turned by 180 degrees; a measured height stays as it is."""
        return inputs._replace(images=inputs.images.flip(-2))


def built(scheme: Scheme, block: dict, size: int, colours: str, classes: int) -> HeightRecogniser:
    """Return a network with fresh weights; arguments as of `lowalt.recognition.recogniser.built`."""
    return HeightRecogniser(
        scheme, block, size, np.stack([colour_map(colours)] * len(SPECTRA)), classes
    )
