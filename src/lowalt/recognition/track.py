"""The height of its target that each station measures: from the beam that follows it and the range cell of its echo.

A cache file (.npz) holds, for the samples of one shard in its order,
    key       (samples,) the sample's key
    height_m  (samples, stations) float64, measured height above the ground (m)
    range_m   (samples, stations) float64, range (m) of the target at the first symbol, as caches of images hold it: two
              runs have samples of the same key, and by their ranges a reader tells whose heights these are

height = height of the station + R (Omega + e)
    R      range, the centre m c / (2 M df) of the cell m = round(r / cell) mod M nearest to the target at the first
           symbol; the data do not keep the cell that each symbol's echo took
    Omega  sine of the elevation, the target's direction cosine along the array's vertical axis
    e      normal error; its variance is the Cramer-Rao bound of the receive array; the sum stays within -1..1

The bound: V elements of a column receive x_v[n] = s[n] exp(j psi v) + noise, psi = pi kappa Omega for elements half a
wavelength of the carrier apart, in each of N symbols; the amplitudes s[n] are unknown, the noise is white and
independent from element to element. The Fisher information of psi is 2 N eta H sum (v - mean v)^2, with eta the SNR of
one element and H columns that add up in phase; the sum is V (V^2 - 1) / 12, and H V eta is the SNR after beamforming,
which is that of the data's signals. So var psi >= 6 / (SNR N (V^2 - 1)).
Assumed: one point on the beam's axis for the whole look, calibrated arrays, no reflection by the ground, an estimate
that reaches the bound. Sources: Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, ch. 3
(bearing); Van Trees, Optimum Array Processing, 2002, ch. 8.
"""

import math
import sys
from pathlib import Path

import numpy as np

from lowalt.common import portable
from lowalt.common.command import parser, pick, run
from lowalt.common.errors import InputError
from lowalt.common.files import replacing
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.common.streams import stream
from lowalt.recognition.views import geometry, located
from lowalt.shards import ShardSet
from lowalt.shards.record import row_of


def elevation_error(network: Network, station: Station, snr_db: float) -> float:
    """Return the standard deviation of a measured direction cosine Omega at an SNR (dB) after beamforming; 0 at +inf.

    Raises: InputError for a receive array of one row, which measures no elevation.
    """
    rows = network.receive[1]
    if rows < 2:
        raise InputError(f"track: receive_array {network.receive} has {rows} row, expected two or more for a height")
    if snr_db == math.inf:
        return 0.0
    snr = float(portable.exp(snr_db * (portable.LN_10 / 10)))
    phase = math.sqrt(6 / (snr * network.symbols * (rows**2 - 1)))
    return phase / (math.pi * station.frequency_hz / network.carrier_hz)


def measured_height_m(network: Network, station: Station, range_m: float, omega: float, error: float = 0.0) -> float:
    """Return the height (m) that a station measures of a target at a range (m) and direction cosine Omega; error: of
    the measured Omega. Range comes from the cell, whose number repeats after the unambiguous range."""
    cell_m = SPEED_OF_LIGHT / (2 * network.subcarriers * network.subcarrier_spacing_hz)
    cell = round(range_m / cell_m) % network.subcarriers
    return station.position_m[2] + cell * cell_m * min(max(omega + error, -1.0), 1.0)


def heights_m(entry: dict, network: Network) -> list[float]:
    """Return the heights (m) that the stations measure of a sample; entry: its record.

    Errors are drawn by the record's root seed, its key and the station's name alone. Raises: InputError for a link
    between two stations, or a target whose place is not known.
    """
    _, snr_db = row_of(entry)
    found = []
    for station in network.stations:
        if station.transmitter is not None:
            raise InputError(f"track: station {station.name!r} is a link, expected stations that hear themselves")
        seen = entry["geometry"][station.name]
        if seen["range_m"] is None or seen["omega"] is None:
            raise InputError(f"track: sample {entry['key']} has no place, expected a simulated target")
        spread, error = elevation_error(network, station, snr_db), 0.0
        if spread:
            error = spread * stream(entry["seed"], "track-height", entry["key"], station.name).standard_normal()
        found.append(measured_height_m(network, station, seen["range_m"], seen["omega"], error))
    return found


def cache_shard(index: str | Path, name: str, out: str | Path) -> int:
    """Write the measured heights of the shard `name` and return its number of samples.

    Raises: InputError where the index has no such shard, its scene has effects, or as `heights_m`.
    """
    _, numbers = located(index, name)
    shards = ShardSet(index, check=False)
    effects = sorted((shards.index["echo"] or {}).get("effects", {}))
    if effects:
        raise InputError(f"{index}: scene with the effects {effects}, of which a measured height knows nothing; "
                         "expected none")  # fmt: skip
    network = Network.from_settings(shards.index["render"]["network"])
    records = [shards.record(number) for number in numbers]
    heights = np.array([heights_m(record, network) for record in records])
    ranges = np.array([geometry(record, network)[0] for record in records])
    keys = np.array([shards.keys[number].decode() for number in numbers])
    with replacing(out, 2 * heights.nbytes) as temporary:
        np.savez(temporary, key=keys, height_m=heights, range_m=ranges)
    return len(numbers)


def main(arguments: list[str]) -> None:
    """Write the heights that the stations measure of one shard's targets. Settings: none ({})."""
    line = parser("lowalt.recognition.track", main.__doc__)
    line.add_argument("--index", required=True, help="index of the shards (.json)")
    line.add_argument("--shard", required=True, help="name of the shard, {group}-{fold}-{part}.tar")
    line.add_argument("--out", required=True, help="measured heights to write (.npz)")
    given = line.parse_args(arguments)
    pick(given.settings)
    count = cache_shard(given.index, given.shard, given.out)
    print(f"{given.out}: {count} samples", file=sys.stderr)


if __name__ == "__main__":
    run(main)
