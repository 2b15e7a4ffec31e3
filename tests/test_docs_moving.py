"""The README's moving picture: its frames, its columns, and the speeds that its spectra show."""

from pathlib import Path

import moving_picture
import numpy as np
import pytest
from moving_picture import FRAME_MS, LAST_FRAME_MS, SUBJECTS, Scene
from PIL import Image
from scipy.signal import find_peaks

from lowalt.motion import positions

ROOT = Path(__file__).parent.parent
MOVING = ROOT / "design/pictures/moving.webp"
STILL = ROOT / "design/pictures/moving.png"
LIMIT_BYTES = 1_000_000


@pytest.fixture(scope="module")
def scenes() -> list[Scene]:
    """What the panels of the drone and of the bird show."""
    return [moving_picture.scene(subject) for subject in SUBJECTS]


def frames_of(path: Path) -> tuple[list[np.ndarray], list[int]]:
    """The frames of an animation as RGB, and how long each is shown (ms)."""
    frames = []
    durations = []
    with Image.open(path) as file:
        for number in range(file.n_frames):
            file.seek(number)
            frames.append(np.asarray(file.convert("RGB")))
            durations.append(file.info["duration"])
    return frames, durations


def spectrum_pixels(frame: np.ndarray, number: int, shape: tuple[int, int]) -> np.ndarray:
    """The colours (rows, columns, 3) of a frame at the middle of each pixel of a spectrum, the most
    receding row first.
    """
    rows, columns = shape
    top = moving_picture.HEIGHT_PX - moving_picture.SPECTRUM_BOTTOM_PX
    top -= moving_picture.SPECTRUM_HEIGHT_PX
    down = top + (np.arange(rows) + 0.5) * moving_picture.SPECTRUM_HEIGHT_PX / rows
    left = moving_picture.LEFTS_PX[number]
    right = left + (np.arange(columns) + 0.5) * moving_picture.PANEL_WIDTH_PX / columns
    return frame[np.ix_(down.astype(int), right.astype(int))]


def whole(shown: Scene) -> np.ndarray:
    """The colours (rows, columns, 3) of the whole spectrum, the most receding row first."""
    _, bottom_mps, top_mps = shown.axes.upwards
    upright = shown.image if top_mps > bottom_mps else shown.image[::-1]
    return shown.palette[upright]


def assert_shows(frame: np.ndarray, scenes: list[Scene], columns: int) -> None:
    """The frame shows the first columns of both spectra, and nothing of the others."""
    for number, shown in enumerate(scenes):
        found = spectrum_pixels(frame, number, shown.image.shape)
        # The lines of the axes cover the outermost rows and columns.
        inner = slice(2, -2)
        expected = whole(shown)
        assert (found[inner, 2 : columns - 2] == expected[inner, 2 : columns - 2]).all()
        assert (found[inner, columns:-2] == 255).all()


def test_a_short_one_shows_more_columns_in_each_frame_and_all_of_them_last(tmp_path, scenes):
    moving = tmp_path / "moving.webp"
    still = tmp_path / "moving.png"
    moving_picture.write(moving, still, 3)
    frames, durations = frames_of(moving)
    assert durations == [FRAME_MS, FRAME_MS, LAST_FRAME_MS]
    for frame, columns in zip(frames, moving_picture.shown_columns(256, 3), strict=True):
        assert_shows(frame, scenes, columns)
    assert (frames[-1] == np.asarray(Image.open(still))).all()
    # The clouds move: their panels, above the spectra, differ from frame to frame.
    clouds = [frame[: moving_picture.HEIGHT_PX // 2] for frame in frames]
    assert (clouds[0] != clouds[1]).any() and (clouds[1] != clouds[2]).any()


def test_the_kept_ones_are_small_and_end_with_the_whole_spectra(scenes):
    frames, durations = frames_of(MOVING)
    assert MOVING.stat().st_size <= LIMIT_BYTES
    assert len(frames) == 256 // moving_picture.COLUMNS_PER_FRAME
    assert durations == [FRAME_MS] * (len(frames) - 1) + [LAST_FRAME_MS]
    assert_shows(frames[0], scenes, moving_picture.COLUMNS_PER_FRAME)
    assert_shows(frames[-1], scenes, 256)
    assert (frames[-1] == np.asarray(Image.open(STILL))).all()


def radial_speeds(shown: Scene) -> np.ndarray:
    """The radial speeds (columns, L) m/s of all points at the times of the columns, from their
    ranges a tenth of a millisecond before and after.
    """
    _, first_s, last_s = shown.axes.across
    times_s = np.linspace(first_s, last_s, shown.image.shape[1])
    step_s = 1e-4
    ranges_m = []
    for shift_s in (-step_s, step_s):
        points = positions(shown.cloud, shown.row, times_s + shift_s)
        ranges_m.append(np.linalg.norm(points - np.array(shown.station.position_m), axis=2))
    before_m, after_m = ranges_m
    return (after_m - before_m) / (2 * step_s)


def rows_mps(shown: Scene) -> np.ndarray:
    """The speed (m/s) of each row of an image, from the middle of its pixels."""
    _, bottom_mps, top_mps = shown.axes.upwards
    rows = len(shown.image)
    return top_mps + (np.arange(rows) + 0.5) / rows * (bottom_mps - top_mps)


def body_speed(shown: Scene) -> float:
    """The mean radial speed (m/s) of a body."""
    of_body = np.array([shown.cloud.kinds[part] == "body" for part in shown.cloud.part])
    return float(radial_speeds(shown)[:, of_body].mean())


def band_distance(shown: Scene) -> float:
    """The distance (m/s) between the lines of two-bladed rotors, by the effective carrier."""
    effective_hz = shown.station.frequency_hz + 255 / 2 * 120e3
    return 2 * shown.row["rate_hz"] * 299_792_458 / (2 * effective_hz)


def test_the_drone_s_bands_stand_at_its_body_and_at_its_folded_blade_flashes(scenes):
    """Blades that pass the line of sight at the rate n F give lines n F apart, which fold."""
    shown = scenes[SUBJECTS.index(moving_picture.DRONE)]
    body_mps = body_speed(shown)
    speeds_mps = rows_mps(shown)
    span_mps = np.ptp(speeds_mps) * len(speeds_mps) / (len(speeds_mps) - 1)
    apart_mps = band_distance(shown)
    expected_mps = [body_mps, body_mps - apart_mps, body_mps - 2 * apart_mps]
    # Three copies make a band at the fold whole.
    brightness = np.tile(shown.image.mean(axis=1), 3)
    peaks, _ = find_peaks(brightness, prominence=10)
    middle = peaks[(peaks >= len(speeds_mps)) & (peaks < 2 * len(speeds_mps))]
    found_mps = speeds_mps[middle - len(speeds_mps)]
    assert len(found_mps) == len(expected_mps)
    for speed_mps in expected_mps:
        away = (found_mps - speed_mps + span_mps / 2) % span_mps - span_mps / 2
        assert abs(away).min() < 0.4, speed_mps


def test_the_bird_s_spectrum_follows_its_wings(scenes):
    """The mean speed of the bright pixels of a column goes with that of the bird's points."""
    shown = scenes[SUBJECTS.index(moving_picture.BIRD)]
    true_mps = radial_speeds(shown).mean(axis=1)
    bright = np.clip(shown.image / 255 - 0.35, 0, 1) ** 2
    seen_mps = rows_mps(shown) @ bright / bright.sum(axis=0)
    assert np.corrcoef(seen_mps, true_mps)[0, 1] > 0.8
    assert abs(seen_mps.mean() - true_mps.mean()) < 0.5


def test_the_readme_says_the_figures_of_the_picture(scenes):
    readme = (ROOT / "README.md").read_text()
    drone = scenes[SUBJECTS.index(moving_picture.DRONE)]
    _, first_s, last_s = drone.axes.across
    frame_s = (last_s - first_s) / (256 / moving_picture.COLUMNS_PER_FRAME)
    assert f"shown {FRAME_MS / 1000 / frame_s:.1f} times slower" in readme
    assert f"speeds beyond {max(map(abs, drone.axes.upwards[1:])):.1f} m/s fold" in readme
    assert f"band at {body_speed(drone):.1f} m/s" in readme
    assert f"repeat it every {band_distance(drone):.1f} m/s" in readme
    assert f"turns {frame_s * drone.row['rate_hz']:.2f} times between two frames" in readme
