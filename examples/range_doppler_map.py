"""The range-Doppler map of a drone over a town: python examples/range_doppler_map.py."""

from pathlib import Path

import matplotlib.pyplot as plt

import lowalt
from lowalt.config.layers import load
from lowalt.spectra.kinds import range_doppler

paths = [Path("config/default.yaml"), Path("config/scenes/urban.yaml")]
dataset = lowalt.Dataset(load(paths, "workflow/schemas/config.schema.yaml"), groups=["seen"])
number = next(n for n in range(len(dataset)) if dataset.key(n) == "dji-mavic-3-pro-000000-snr013")
network, cube = dataset.maker.network, dataset.cubes(number)[0]  # station A
settings = range_doppler.Settings(cells=65, points=512)
(across, *speeds), (upwards, *ranges) = range_doppler.axes(settings, network, network.stations[0])
plt.imshow(
    range_doppler.definition(cube, settings) ** 0.5,
    origin="lower",
    aspect="auto",
    extent=(*speeds, *ranges),
)
plt.gca().set(xlabel=across, ylabel=upwards)
plt.savefig("map.png")
