"""The README's picture: a drone and a bird whose spectra grow column by column while they move.

    python docs/moving_picture.py --animation design/pictures/moving.webp
        --still design/pictures/moving.png

Both are clean samples of the embedded default. The upper panels show the cloud in the target's own
frame at the instant of the newest column. The lower panels show the image that a network receives.
The still picture is the last frame.
"""

import argparse
import io
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from PIL import Image

from lowalt.config.command import run
from lowalt.config.layers import overlaid
from lowalt.config.network import Station
from lowalt.files.atomic import replacing
from lowalt.motion import positions
from lowalt.recognition.distances import still_row
from lowalt.report.figures.style import plt
from lowalt.report.figures.target_picture import DIRECTIONS, draw_view
from lowalt.report.figures.tile_axes import Axes, axes_of
from lowalt.shards.kept_datasets import dataset_of_subtype
from lowalt.targets.cloud import Cloud
from lowalt.tiles.render import split

SPECTRUM = "trp"
"""Its window is 20 ms long, much shorter than a wing beat."""
COLUMNS_PER_FRAME = 4
FRAME_MS = 100
LAST_FRAME_MS = 2000
DPI = 100
WIDTH_PX = 1320
HEIGHT_PX = 930
LEFTS_PX = (138, 788)
PANEL_WIDTH_PX = 512
"""A whole number of pixels for each of an image's 256 columns."""
CLOUD_HEIGHT_PX = 270
CLOUD_BOTTOM_PX = 570
SPECTRUM_HEIGHT_PX = 360
SPECTRUM_BOTTOM_PX = 88
LETTERS_PT = 23
"""Legible where a phone shows the picture at less than a third of its size."""
DOT_PT2 = 30
MARGIN = 1.08


class Subject(NamedTuple):
    """A sample of the picture: subtype, motion model, station, view of the cloud, and what its parts
    do, with a place for their rate.
    """

    subtype: str
    model: int
    station: str
    view: tuple[str, int, int]
    does: str


ABOVE, _, BEHIND = DIRECTIONS
DRONE = Subject("DJI Mini 4 Pro", 61, "A", ABOVE, "rotors: {:.0f} turns per second")
BIRD = Subject("Eagle", 29, "C", BEHIND, "wings: {:.1f} beats per second")
SUBJECTS = (DRONE, BIRD)


class Scene(NamedTuple):
    """What the panels of a subject show: `row` of the motion table, `image` (S, S) uint8 index
    values with its axes, and the colours of these values (256, 3) uint8.
    """

    cloud: Cloud
    row: dict
    station: Station
    image: np.ndarray
    axes: Axes
    palette: np.ndarray


def scene(subject: Subject) -> Scene:
    """Return the panels' content of a sample without noise, as a shard of the default holds it."""
    dataset = dataset_of_subtype(overlaid([]), subject.subtype)
    place = dataset.place_of(subject.subtype, subject.model, float("inf"))
    renderer = dataset.maker.renderer
    names = list(renderer.spectra)
    stations = [station.name for station in renderer.network.stations]
    row = stations.index(subject.station)
    station = renderer.network.stations[row]
    images = split(dataset.made(place).image, len(names))
    return Scene(
        dataset.clouds[subject.subtype],
        dataset.row(place),
        station,
        images[row * len(names) + names.index(SPECTRUM)],
        axes_of(SPECTRUM, station, renderer),
        renderer.images.palette,
    )


def shown_columns(columns: int, frames: int | None = None) -> list[int]:
    """Return how many columns of an image each frame shows, the last one all of them.

    frames: number of frames (default: one for each COLUMNS_PER_FRAME columns).
    """
    frames = frames or columns // COLUMNS_PER_FRAME
    return [round(columns * (number + 1) / frames) for number in range(frames)]


def canvas() -> tuple:
    """Return a figure with the panels of the clouds (2,) and of the spectra (2,), placed by pixel."""
    figure = plt.figure(figsize=(WIDTH_PX / DPI, HEIGHT_PX / DPI), dpi=DPI)
    width = PANEL_WIDTH_PX / WIDTH_PX
    clouds = []
    spectra = []
    for left_px in LEFTS_PX:
        left = left_px / WIDTH_PX
        above = (left, CLOUD_BOTTOM_PX / HEIGHT_PX, width, CLOUD_HEIGHT_PX / HEIGHT_PX)
        below = (left, SPECTRUM_BOTTOM_PX / HEIGHT_PX, width, SPECTRUM_HEIGHT_PX / HEIGHT_PX)
        clouds.append(figure.add_axes(above))
        spectra.append(figure.add_axes(below))
    return figure, clouds, spectra


def draw_spectrum(panel, shown: Scene) -> None:
    """Draw the axes of a spectrum, receding upwards, and its image without any column."""
    _, first_s, last_s = shown.axes.across
    _, bottom_mps, top_mps = shown.axes.upwards
    panel.set(xlim=(first_s, last_s), ylim=sorted((bottom_mps, top_mps)))
    panel.set(xlabel="time (s)", xticks=np.arange(0.2, 1.0, 0.2), yticks=range(-6, 7, 3))
    extent = (first_s, last_s, bottom_mps, top_mps)
    nothing = np.zeros((*shown.image.shape, 4), np.uint8)
    panel.imshow(nothing, aspect="auto", interpolation="nearest", extent=extent)
    panel.set_ylim(sorted((bottom_mps, top_mps)))


def coloured(shown: Scene, columns: int) -> np.ndarray:
    """Return the first columns of an image as RGBA (S, S, 4) uint8, transparent in all others."""
    pixels = np.zeros((*shown.image.shape, 4), np.uint8)
    pixels[:, :columns, :3] = shown.palette[shown.image[:, :columns]]
    pixels[:, :columns, 3] = 255
    return pixels


def draw_cloud(panel, subject: Subject, shown: Scene, moved: np.ndarray, step: int) -> None:
    """Draw a cloud anew as it stands at one step of moved (steps, L, 3) m, all of which fits."""
    panel.clear()
    lowest = moved.min(axis=(0, 1))
    highest = moved.max(axis=(0, 1))
    middle = (lowest + highest) / 2
    _, across, up = subject.view
    flatness = CLOUD_HEIGHT_PX / PANEL_WIDTH_PX
    reach_m = (highest - lowest) / 2
    half_m = MARGIN * max(reach_m[across], reach_m[up] / flatness)
    draw_view(panel, shown.cloud, moved[step], subject.view, middle, half_m)
    panel.set_ylim(middle[up] - flatness * half_m, middle[up] + flatness * half_m)
    panel.collections[0].set_sizes([DOT_PT2])
    panel.locator_params(nbins=4, steps=[1, 2, 5, 10])
    does = subject.does.format(shown.row["rate_hz"])
    panel.set_title(f"{subject.subtype}, {subject.view[0]}\n{does}")


def frames(count: int | None = None) -> Iterator[Image.Image]:
    """Yield the frames of the animation; count: as in `shown_columns`."""
    scenes = [scene(subject) for subject in SUBJECTS]
    columns = scenes[0].image.shape[1]
    steps = shown_columns(columns, count)
    moved = []
    for shown in scenes:
        _, first_s, last_s = shown.axes.across
        newest = np.array(steps) - 1
        times_s = np.linspace(first_s, last_s, columns)[newest]
        moved.append(positions(shown.cloud, still_row(shown.row), times_s))
    with plt.rc_context({"font.size": LETTERS_PT, "axes.titlesize": LETTERS_PT}):
        figure, clouds, spectra = canvas()
        for panel, shown in zip(spectra, scenes, strict=True):
            draw_spectrum(panel, shown)
        spectra[0].set_ylabel("radial speed (m/s)")
        for step, count_shown in enumerate(steps):
            for number, shown in enumerate(scenes):
                draw_cloud(clouds[number], SUBJECTS[number], shown, moved[number], step)
                spectra[number].images[0].set_data(coloured(shown, count_shown))
            buffer = io.BytesIO()
            figure.savefig(buffer, format="png", dpi=DPI)
            yield Image.open(buffer).convert("RGB")
        plt.close(figure)


def write(animation: str, still: str, count: int | None = None) -> None:
    """Write the animation (.webp) without loss, and its last frame (.png).

    count: as in `shown_columns`.
    """
    first, *others = frames(count)
    durations = [FRAME_MS] * len(others) + [LAST_FRAME_MS]
    with replacing(animation) as temporary:
        first.save(
            temporary,
            format="webp",
            save_all=True,
            append_images=others,
            duration=durations,
            loop=0,
            lossless=True,
            quality=75,
            method=4,
            minimize_size=True,
        )
    with replacing(still) as temporary:
        others[-1].save(temporary, format="png", optimize=True)


def main(arguments: list[str]) -> None:
    """Write both pictures."""
    line = argparse.ArgumentParser("moving_picture.py", description=__doc__)
    line.add_argument("--animation", required=True, help="moving picture to write (.webp)")
    line.add_argument("--still", required=True, help="last frame to write (.png)")
    options = line.parse_args(arguments)
    write(options.animation, options.still)


if __name__ == "__main__":
    run(main)
