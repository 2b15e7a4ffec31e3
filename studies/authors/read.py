"""Lengths of the authors' targets, read from their videos: rotors, layers, hubs, wings, wheels,
gait, shares of points.

A view is orthographic, so a place (x, y, z) lies at pixel O + x e_x + y e_y + z e_z, and the ticks
of the axes give the three vectors. Rotors turn about z: the union of a rotor's dots over the frames
is an ellipse whose width tells the radius and whose height, beyond that, the distance between two
layers. Wings are mirror images of each other in x: two tips give all three coordinates. Wheels turn
about x: see `wheel`. Pedestrians: see `pedestrians`. Run as `python read.py FOLDER readings.csv`;
FOLDER holds `videos/`. The pedestrians' nodes over a cycle go to `paths.csv` beside the readings,
in millimetres.
"""

import csv
import sys
from pathlib import Path

try:
    import av
except ModuleNotFoundError:  # pairs.py reads pictures alone
    av = None
import numpy as np
import pedestrians
from scipy import ndimage

# Corner, end of the x edge, of the y edge, and top of the z edge, in pixels of the first frame.
BOXES = {
    "UAV": ((560, 822), (1112, 672), (134, 628), (134, 202)),
    "Bird": ((492, 822), (1110, 697), (134, 608), (134, 177)),
    "Vehicle": ((559, 823), (1111, 674), (134, 628), (134, 203)),
    "Pedestrian": ((559, 823), (1111, 674), (134, 628), (134, 203)),
}
# First label and step of the x, y and z axis, in metres, read by eye; the places of the ticks are
# found.
LABELS = {
    "UAV_01_DJI_Mini_2": (-0.15, 0.05, -0.1, 0.1, -0.2, 0.1),
    "UAV_02_DJI_Mini_4_Pro": (-0.3, 0.1, -0.2, 0.1, -0.4, 0.2),
    "UAV_03_DJI_Avata": (-0.15, 0.05, -0.1, 0.1, -0.06, 0.02),
    "UAV_04_DJI_Mavic_3_Pro": (-0.2, 0.1, -0.2, 0.1, -0.2, 0.1),
    "UAV_05_DJI_Mavic_4_Pro": (-0.4, 0.2, -0.4, 0.2, -0.4, 0.2),
    "UAV_06_DJI_Inspire_2": (-0.6, 0.2, -0.5, 0.5, -0.5, 0.5),
    "UAV_07_Type_A_Firefighting_UAV": (-2.0, 1.0, -2.0, 1.0, -1.0, 0.5),
    "UAV_08_Type_B_Firefighting_UAV": (-2.0, 1.0, -2.0, 1.0, -1.0, 0.5),
    "UAV_09_DJI_Matrice_600_Pro": (-1.0, 0.5, -1.0, 0.5, -1.0, 0.5),
    "UAV_10_EH_216_S": (-6.0, 2.0, -5.0, 5.0, -3.0, 1.0),
    "Bird_01_Crow": (0.5, -0.5, 0.5, -0.5, -0.5, 0.5),
    "Bird_02_Eagle": (1.0, -0.5, 1.0, -0.5, -1.0, 0.5),
    "Bird_03_Kingfisher": (0.2, -0.1, 0.2, -0.2, -0.3, 0.1),
    "Bird_04_Parrot": (0.2, -0.1, 0.2, -0.2, -0.3, 0.1),
    "Bird_05_Pigeon": (0.2, -0.1, 0.2, -0.2, -0.3, 0.1),
    "Bird_06_Ramphastidae": (0.5, -0.5, 0.5, -0.5, -0.5, 0.5),
    "Bird_07_Sparrow": (0.2, -0.1, 0.2, -0.2, -0.3, 0.1),
    "Bird_08_Seagull": (1.0, -0.5, 1.0, -0.5, -1.0, 0.5),
    "Bird_09_Owl": (1.0, -0.5, 1.0, -0.5, -1.0, 0.5),
    "Bird_10_Wild_Goose": (0.5, -0.5, 0.5, -0.5, -0.5, 0.5),
    "Vehicle_01_AITO_M9_2024": (-5, 5, -5, 5, -2, 1),
    "Vehicle_02_Tesla_Roadster_2020": (-5, 5, -5, 5, -2, 1),
    "Vehicle_03_Xiaomi_SU7_2024": (-5, 5, -5, 5, -2, 1),
    "Vehicle_04_XPeng_G9_2022": (-5, 5, -5, 5, -2, 1),
    "Vehicle_05_ZEEKR_001_2022": (-5, 5, -5, 5, -2, 1),
    "Vehicle_06_Audi_A6L_2019": (-5, 5, -5, 5, -2, 1),
    "Vehicle_07_BYD_Song_L_EV_2024": (-5, 5, -5, 5, -2, 1),
    "Vehicle_08_Geely_Galaxy_L7_2024": (-5, 5, -5, 5, -2, 1),
    "Vehicle_09_Leading_Ideal_L8_2023": (-5, 5, -5, 5, -2, 1),
    "Vehicle_10_NIO_ET5T_2023": (-5, 5, -5, 5, -2, 1),
    "Pedestrian_01_Walking_Pedestrian_1": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_02_Walking_Pedestrian_2": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_03_Walking_Pedestrian_3": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_04_Walking_Pedestrian_4": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_05_Walking_Pedestrian_5": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_06_Walking_Pedestrian_6": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_07_Walking_Pedestrian_7": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_08_Walking_Pedestrian_8": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_09_Running_Pedestrian_1": (-2, 1, -2, 1, -2, 1),
    "Pedestrian_10_Running_Pedestrian_2": (-2, 1, -2, 1, -2, 1),
}
COLOURS = {
    "body": (0, 114, 189), "red": (255, 0, 0), "black": (0, 0, 0), "green": (0, 255, 0), "blue": (0, 0, 255),
    "yellow": (255, 255, 0), "magenta": (255, 0, 255),
}  # fmt: skip
FRAMES = 90
"""Frames that are looked at, evenly over a video: a rotor has passed all its angles in them."""
DOT = 2.0
"""Pixels by which a dot's middle may be off, mostly where dots overlap."""
DOT_AREA = 30
"""Pixels of a dot."""


def frames(path: Path, count: int) -> list[np.ndarray]:
    """Return `count` frames (rows, columns, 3) of a video, evenly over its time."""
    with av.open(str(path)) as video:
        total = video.streams.video[0].frames
        wanted = set(np.linspace(0, total - 1, count).round().astype(int).tolist())
        shown = enumerate(video.decode(video=0))
        return [frame.to_ndarray(format="rgb24") for place, frame in shown if place in wanted]


def ticks(dark: np.ndarray, start: tuple, end: tuple, outward: np.ndarray) -> np.ndarray:
    """Return the places of an axis's ticks (pixels from its start); they stand out of its line
    along `outward`.
    """
    start, along = np.array(start), np.subtract(end, start)
    steps = np.arange(-2, int(np.hypot(*along)) + 3)
    line = start + along * steps[:, None] / np.hypot(*along)
    seen = (
        sum(
            dark[tuple(np.rint(line + outward * away).astype(int)[:, ::-1].T)] for away in (5, 7, 9)
        )
        >= 2
    )
    runs, count = ndimage.label(seen)
    return np.array([steps[runs == number].mean() for number in range(1, count + 1)])


def axes(frame: np.ndarray, name: str) -> np.ndarray:
    """Return the projection (4, 2): pixels of the origin, and pixels a metre of x, y and z."""
    corner, x_end, y_end, top = BOXES[name.split("_")[0]]
    dark = frame.max(2) < 170
    labels = LABELS[name]
    edges = (
        (corner, x_end, np.subtract(corner, y_end)),
        (corner, y_end, np.subtract(corner, x_end)),
        (y_end, top, np.array((-2, -1))),
    )
    origin = np.array(corner, float)
    vectors = []
    for number, (start, end, outward) in enumerate(edges):
        places = ticks(dark, start, end, outward / np.hypot(*outward))
        unit = np.subtract(end, start) / np.hypot(*np.subtract(end, start))
        first, step = labels[2 * number : 2 * number + 2]
        scale = np.polyfit(np.arange(len(places)), places, 1)
        vectors.append(unit * scale[0] / step)
        origin += unit * (scale[1] - scale[0] * first / step)
    return np.array([origin, *vectors])


def dots(frame: np.ndarray, box: str) -> dict[str, tuple[np.ndarray, int]]:
    """Return of each colour the middles (dots, 2) of its dots inside the axes, in pixels, and its
    count of pixels.
    """
    corner, x_end, y_end, top = map(np.array, BOXES[box])
    rows, columns = np.nonzero(frame.min(2) < 180)
    places = np.stack([columns, rows], 1)
    inside = np.all(
        [
            _beyond(places, corner, x_end) < -8,
            _beyond(places, corner, y_end) > 8,
            columns > top[0] + 8,
            columns < x_end[0],
            rows > 60,
        ],
        axis=0,
    )
    rows = rows[inside]
    columns = columns[inside]
    away = (
        (frame[rows, columns].astype(int)[:, None, :] - np.array(list(COLOURS.values()))) ** 2
    ).sum(2)
    first = np.array([rows.min() - 2, columns.min() - 2])
    rows = rows - first[0]
    columns = columns - first[1]
    found = {}
    for number, colour in enumerate(COLOURS):
        mask = np.zeros((rows.max() + 3, columns.max() + 3), bool)
        own = (away.argmin(1) == number) & (away[:, number] < 120**2)
        mask[rows[own], columns[own]] = True
        # Lines and the rims of other dots are thinner than a dot.
        mask = ndimage.binary_opening(mask, np.ones((3, 3)))
        runs, count = ndimage.label(mask)
        middles = np.array(ndimage.center_of_mass(mask, runs, range(1, count + 1))).reshape(-1, 2)
        found[colour] = (middles + first)[:, ::-1], int(mask.sum())
    return found


def _beyond(places: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Pixels by which places (K, 2) lie to the right of the line from start to end, seen along it
    with y down.
    """
    along = (end - start) / np.hypot(*(end - start))
    return along[0] * (places[:, 1] - start[1]) - along[1] * (places[:, 0] - start[0])


def craft(name: str, shown: list[np.ndarray]) -> list[tuple]:
    """Return the readings of a craft: share that turns, and each rotor's diameter, distance of
    layers and place.
    """
    base = axes(shown[0], name)
    plan = base[1:3].T
    seen = [dots(frame, "UAV") for frame in shown]
    # Shares follow from pixels, since dots of all colours overlap alike.
    pixels = {colour: np.mean([found[colour][1] for found in seen]) for colour in COLOURS}
    share = 1 - pixels["body"] / sum(pixels.values())
    rows = [(name, "share of points that turn", share, 0.03, "1")]
    hubs = {}
    unit = np.sqrt((plan**2).sum(1))
    for colour in list(COLOURS)[1:]:
        places = np.concatenate([found[colour][0] for found in seen])
        if pixels[colour] < 40 or (colour == "magenta" and name.startswith("UAV_10")):
            continue  # no such rotor, or three pairs in one colour
        low = np.percentile(places, 0.2, axis=0)
        high = np.percentile(places, 99.8, axis=0)
        radius = (high - low)[0] / 2 / unit[0]
        gap = ((high - low)[1] - 2 * radius * unit[1]) / abs(base[3, 1])
        hubs[colour] = (low + high) / 2
        rows.append((name, f"{colour} rotor, diameter", 2 * radius, 2 * DOT / unit[0], "m"))
        rows.append(
            (name, f"{colour} rotor, layers apart", gap, 2 * DOT * 1.5 / abs(base[3, 1]), "m")
        )
    some = [found["red"][0] for found in seen[::9]]
    told = {
        what.partition(",")[2].strip(): value
        for _, what, value, _, _ in rows
        if what.startswith("red")
    }
    apart = told["layers apart"] if told["layers apart"] > 0.1 * told["diameter"] else 0.0
    count, turn, left = blades(base, some, told["diameter"] / 2, apart)
    rows.append((name, "red rotor, blades a layer", count, left, "1, pixels left"))
    if apart:
        rows.append((name, "red rotor, turn of the lower layer", turn, 0.01, "turns"))
    # Hubs of one height differ in x and y alone. Four or six of them stand about their middle.
    places = np.array(list(hubs.values()))
    spots = np.linalg.solve(plan, (places - places.mean(0)).T).T
    for colour, spot in zip(hubs, spots, strict=True):
        rows += [
            (name, f"{colour} hub, {axis}", value, 2 * DOT / np.hypot(*plan[:, 0]), "m")
            for axis, value in zip("xy", spot, strict=True)
        ]
    rows.append(
        (name, "hub circle, diameter", 2 * circle(spots), 4 * DOT / np.hypot(*plan[:, 0]), "m")
    )
    body = np.concatenate([found["body"][0] for found in seen[::30]])
    rows.append(
        (
            name,
            "body, height in the picture",
            np.ptp(body[:, 1]) / abs(base[3, 1]),
            np.nan,
            "m, at most",
        )
    )
    return rows


def blades(
    base: np.ndarray, seen: list[np.ndarray], radius: float, gap: float
) -> tuple[int, float, float]:
    """Return number of blades a layer, turn from the upper to the lower layer (turns), and mean
    pixels left.

    seen: places (dots, 2) of one rotor's dots in some frames; radius, gap: m. Each frame is fitted
    by segments from the hub, equal in all layers; more blades are taken only where they leave less
    than 0.6 of what fewer do.
    """
    everywhere = np.concatenate(seen)
    hub = (everywhere.min(0) + everywhere.max(0)) / 2
    plan = base[1:3].T
    best = (0, 0.0, np.inf)
    for count in (2, 3, 4, 5):
        angles = np.arange(0, 360 // count, 3)
        left = []
        turns = []
        ends = radius * np.exp(1j * np.radians(angles[:, None] + 360 / count * np.arange(count)))
        spokes = np.stack([ends.real, ends.imag], -1) @ plan.T
        for places in seen:
            off = []
            for depth in (gap / 2, -gap / 2):
                away = places - hub - base[3] * depth
                along = np.clip(
                    (away[None, None] * spokes[:, :, None]).sum(3) / (spokes**2).sum(2)[..., None],
                    0,
                    1,
                )
                off.append(
                    np.hypot(*np.moveaxis(away - along[..., None] * spokes[:, :, None], 3, 0)).min(
                        1
                    )
                )
            cost = np.minimum(off[0][:, None], off[1][None]).mean(2)
            upper, lower = np.unravel_index(cost.argmin(), cost.shape)
            left.append(cost.min())
            turns.append((angles[lower] - angles[upper]) / 360 % (1 / count))
        if np.mean(left) < 0.6 * best[2]:
            # A turn is an angle: its mean is that of its phasors.
            middle = (
                np.angle(np.exp(2j * np.pi * count * np.array(turns)).mean())
                / (2 * np.pi * count)
                % (1 / count)
            )
            best = (count, float(middle), float(np.mean(left)))
    return best


def circle(places: np.ndarray) -> float:
    """Return the radius of the circle through places (K, 2) in the sense of least squares."""
    solved = np.linalg.lstsq(
        np.column_stack([2 * places, np.ones(len(places))]), (places**2).sum(1), rcond=None
    )[0]
    return float(np.sqrt(solved[2] + solved[0] ** 2 + solved[1] ** 2))


def bird(name: str, shown: list[np.ndarray]) -> list[tuple]:
    """Return the readings of a bird: share of its wings, span from tip to tip, range of the tips,
    chord at the root.
    """
    base = axes(shown[0], name)
    seen = [dots(frame, "Bird") for frame in shown]
    pixels = {
        colour: np.mean([found[colour][1] for found in seen]) for colour in ("body", "red", "black")
    }
    unit = base[1] / np.hypot(*base[1])
    tips = []
    for found in seen:
        left = found["red"][0][:, None]
        right = found["black"][0][None]
        apart = right - left
        # Mirror images have equal y and z, so they lie apart along e_x alone. The tips are the
        # farthest such pair.
        off = abs(unit[0] * apart[..., 1] - unit[1] * apart[..., 0])
        along = np.where(off < 2 * DOT, abs(apart @ unit), 0)
        tip = np.unravel_index(along.argmax(), along.shape)
        x = along[tip] / np.hypot(*base[1]) / 2
        middle = (left[tip[0], 0] + right[0, tip[1]]) / 2
        tips.append((x, *np.linalg.solve(base[2:].T, middle - base[0])))
    good = np.array(tips)
    error = 2 * DOT / np.hypot(*base[1])
    widest = good[np.argsort(good[:, 0])[-5:]]
    return [
        (name, "share of points on wings", 1 - pixels["body"] / sum(pixels.values()), 0.03, "1"),
        (name, "span tip to tip, widest", 2 * np.median(widest[:, 0]), error, "m"),
        (name, "tip at the widest, z", np.median(widest[:, 2]), error, "m"),
        (name, "tip highest, z", good[:, 2].max(), error, "m"),
        (name, "tip highest, x", good[good[:, 2].argmax(), 0], error, "m"),
        (name, "tip lowest, z", good[:, 2].min(), error, "m"),
        (name, "tip lowest, x", good[good[:, 2].argmin(), 0], error, "m"),
    ]


def wheel(base: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return a wheel's middle (pixels, 2), radius and half width (m) from the dots (dots, 2) of all
    frames.

    Dots that turn about x fill the surface of a cylinder. Along a direction n of the picture it
    reaches from its middle by radius |(n e_y, n e_z)| + half width |n e_x|, so the outline gives
    all four by least squares.
    """
    angles = np.radians(np.arange(0, 360, 6))
    ways = np.stack([np.cos(angles), np.sin(angles)], 1)
    reach = [ways, np.hypot(ways @ base[2], ways @ base[3])[:, None], abs(ways @ base[1])[:, None]]
    return np.linalg.lstsq(np.hstack(reach), (ways @ places.T).max(1), rcond=None)[0]


def rolling(base: np.ndarray, seen: list[np.ndarray], found: np.ndarray, count: int) -> float:
    """Return the share of frames in which a wheel's top moves on to +y, of those in which it turns.

    `found` is what `wheel` returned; `count` dots stand evenly on each edge of the rim; frames may
    repeat.
    """
    middle, radius, half = found[:2], *found[2:]
    phasors = []
    for places in seen:
        y, z = np.linalg.solve(base[2:].T, (places - middle - half * base[1]).T) / radius
        rim = abs(np.hypot(y, z) - 1) < 0.12
        phasors.append(np.exp(1j * count * np.arctan2(y, z)[rim]).sum())
    steps = np.degrees(np.angle(np.array(phasors[1:]) * np.conj(phasors[:-1]))) / count
    return float(np.mean(steps[abs(steps) > 1] > 0))


def car(name: str, shown: list[np.ndarray]) -> list[tuple]:
    """Return the readings of a car: its wheels' points, places, size and way, and the share of
    points that turn.
    """
    base = axes(shown[0], name)
    seen = [dots(frame, "Vehicle") for frame in shown]
    colours = [
        colour
        for colour in ("red", "black", "green", "blue")
        if max(len(found[colour][0]) for found in seen)
    ]
    each = max(len(found[colour][0]) for found in seen for colour in colours)
    body = np.mean([found["body"][1] for found in seen]) / DOT_AREA
    wheels = np.array(
        [wheel(base, np.concatenate([found[colour][0] for found in seen])) for colour in colours]
    )
    # The four stand about x = 0 at equal height, so their middle gives y and z, and each one then x
    # and y.
    middle = wheels[:, :2].mean(0)
    y, z = np.linalg.solve(base[2:].T, middle - base[0])
    spots = np.linalg.solve(base[1:3].T, (wheels[:, :2] - middle).T).T + np.array([0, y])
    front = spots[:, 1] > y
    right = spots[:, 0] > 0
    ahead = [
        rolling(base, [found[colour][0] for found in seen], row, each // 2)
        for colour, row in zip(colours, wheels, strict=True)
    ]
    error = DOT / 2 / np.hypot(*base[2])
    rows = [
        (name, "wheels", len(colours), 0, "1"),
        (name, "points a wheel", each, 0, "1"),
        (name, "share of points that turn", 4 * each / (4 * each + body), 0.02, "1"),
    ]
    for (x, along), foremost, aside in zip(spots, front, right, strict=True):
        place = f"{'front' if foremost else 'rear'} {'right' if aside else 'left'} wheel"
        rows += [(name, f"{place}, x", x, error, "m"), (name, f"{place}, y", along, error, "m")]
    return [
        *rows,
        (name, "wheel base", spots[front, 1].mean() - spots[~front, 1].mean(), error, "m"),
        (name, "track", spots[right, 0].mean() - spots[~right, 0].mean(), error, "m"),
        (name, "wheel, diameter", 2 * wheels[:, 2].mean(), np.ptp(wheels[:, 2]) + 0.005, "m"),
        (name, "wheel, edges apart", 2 * wheels[:, 3].mean(), np.ptp(wheels[:, 3]) + 0.01, "m"),
        (name, "wheel, middle above z = 0", z, error, "m"),
        (name, "share of frames that roll to +y", np.mean(ahead), np.ptp(ahead), "1"),
    ]


def walker(name: str, path: Path) -> tuple[list[tuple], np.ndarray]:
    """Return the readings of a pedestrian, and the paths (K, 31, 3) m of its nodes over a cycle."""
    with (Path(__file__).parent / "starts.csv").open() as file:
        start = next(
            np.array(row[1:], float).reshape(-1, 2) for row in csv.reader(file) if row[0] == name
        )
    base = None
    times = []
    pixels = []
    with av.open(str(path)) as video:
        for frame in video.decode(video=0):
            shown = frame.to_ndarray(format="rgb24")
            base = axes(shown, name) if base is None else base
            times.append(frame.time)
            pixels.append(pedestrians.dot_pixels(shown))
    paths, found = pedestrians.read(start, base[1:].T, np.array(times), pixels)
    return [(name, *row) for row in pedestrians.readings(paths, found)], paths


def main(folder: Path, out: Path) -> None:
    """Read all targets and write the tables."""
    readers = {"UAV": craft, "Bird": bird, "Vehicle": car}
    with (
        out.open("w", newline="") as file,
        out.with_name("paths.csv").open("w", newline="") as file_of_paths,
    ):
        writer, paths_writer = (
            csv.writer(opened, lineterminator="\n") for opened in (file, file_of_paths)
        )
        writer.writerow(("target", "quantity", "value", "error", "unit"))
        paths_writer.writerow(
            ("target", "phase", *(f"{node}_{axis}" for node in pedestrians.NODES for axis in "xyz"))
        )
        for name in LABELS:
            category = name.split("_")[0]
            video = folder / "videos" / f"Target40_{name}.mp4"
            if category == "Pedestrian":
                rows, paths = walker(name, video)
                for number, places in enumerate(1000 * paths[::2]):
                    paths_writer.writerow((name, number, *places.ravel().round().astype(int)))
            else:
                rows = readers[category](name, frames(video, FRAMES))
            for target, what, value, error, unit in rows:
                writer.writerow((target, what, f"{value:.4g}", f"{error:.2g}", unit))
            print(name, file=sys.stderr)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
