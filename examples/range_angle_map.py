"""The range-angle map of a drone, from a cube per element: python examples/range_angle_map.py."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import lowalt
from lowalt.config.layers import load
from lowalt.config.network import SPEED_OF_LIGHT, Network

config = load([Path("config/default.yaml")], "workflow/schemas/config.schema.yaml")
mast = config["network"]["stations"]["A"]
site = Network.from_settings(config["network"]).station("A")
half_m = SPEED_OF_LIGHT / site.frequency_hz / 2 * site.horizontal
elements = {
    f"E{k}": {**mast, "position_m": (site.position_m + k * half_m).tolist()} for k in range(8)
}
links = {f"A-E{k}": {"transmit": "A", "receive": f"E{k}"} for k in range(8)}
config["network"] |= {"receive_array": [1, 1], "stations": {"A": mast, **elements, **links}}
config["motion"]["region"]["polygon_m"] = [[0, 0], [500, 0], [250, 433]]
config["effects"] = {"direct_path": {"loss_db": None}}
config["targets"]["select"] = ["DJI Mini 2"]
dataset = lowalt.Dataset(config, groups=["seen"])
cubes = dataset.cubes(5)[1:9]
cells = np.stack([cube.cells for cube in cubes])  # (elements, symbols, range cells)
power = np.mean(np.abs(np.fft.fftshift(np.fft.fft(cells, 64, axis=0), axes=0)) ** 2, axis=1)
plt.imshow(
    power**0.5, origin="lower", aspect="auto", extent=(0, 256 * dataset.maker.network.cell_m, -1, 1)
)
plt.gca().set(xlabel="range (m)", ylabel="direction cosine along the array")
plt.savefig("angle.png")
