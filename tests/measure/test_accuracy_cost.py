"""What accuracy costs in time: fronts, paired differences and extrapolation by construction; times
that add up.
"""

import csv
import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.files.errors import InputError
from lowalt.measure import accuracy_cost, network_speed
from lowalt.recognition import predictions, samples, schemes, statistics
from trainings import with_training

SNRS = (3.0, np.inf)
HEAD = ",".join((*schemes.COLUMNS, *schemes.OPTIONAL))
ROWS = (
    "base,ABC,VRP+TRP+VT,attention,,unseen,,,",
    "small,A,VT,attention,,unseen,24,,0.5",
    "large,ABC,VRP+TRP+VT,mean,vit_base_patch16_224,unseen,224,,",
)


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12))
def test_the_front_is_what_no_point_beats_by_the_definition(points):
    cost, worth = np.array([*points, (np.nan, 9)], float).T
    found = statistics.pareto(cost, worth)
    # A point without a cost is on no front.
    assert not found[-1]
    for kept, (cost, value) in zip(found, points, strict=False):
        beaten = any(c <= cost and v >= value and (c < cost or v > value) for c, v in points)
        assert kept == (not beaten)


def run_of(folder, name, wrong, count=40, seed=0, took=12.5):
    """The file of predictions of 40 motion models of unseen and of seen subtypes, the first `wrong`
    called wrong.
    """
    columns = {
        "group": np.repeat(["unseen", "seen"], 2 * count),
        "fold": np.full(4 * count, "test"),
    }
    model = np.tile(np.arange(count).repeat(2), 2)
    label = model % 4
    facts = samples.Facts(
        key=np.array([f"k{n:03d}" for n in range(4 * count)]),
        subtype=np.char.add(columns["group"], label.astype(str)),
        model=model,
        snr_db=np.tile(SNRS, 2 * count),
        label=label,
        range_m=np.ones((4 * count, 3)),
        aspect_rad=np.ones((4 * count, 3)),
        **columns,
    )
    guess = np.where(model < wrong, (label + 1) % 4, label)
    path = folder / f"{name}-{seed}.csv"
    predictions.write(path, predictions.from_facts(facts, (0,), np.eye(4)[guess]))
    path.with_suffix(".json").write_text(
        json.dumps(
            {
                "protocol": "unseen",
                "scheme": name,
                "seed": seed,
                "hardware": "here",
                "steps": 30,
                "train_samples": 77,
                "train_processor_s": took,
            }
        )
    )
    return str(path)


def speed_of(folder, name, fast):
    path = folder / f"speed-{name}.json"
    path.write_text(
        json.dumps(
            {
                "scheme": name,
                "size": 24,
                "parameters": 99,
                "inference_ms_1": 2 * fast,
                "inference_ms_64": fast,
                "train_ms": 3.0,
                "batch": 8,
                "steps": 1000,
                "backbone": "x",
                "hardware": "here",
            }
        )
    )
    return str(path)


def written(folder, predictions, speeds, presets=()):
    """The table's rows by scheme, as the command writes them from files."""
    (folder / "schemes.csv").write_text("\n".join((HEAD, *ROWS)) + "\n")
    (folder / "presets.csv").write_text(
        "\n".join((",".join(accuracy_cost.PRESETS), *presets)) + "\n"
    )
    runs = [{"rule_name": "echo", "s": 6, "cpu_time": cpu_s, "max_rss": None} for cpu_s in (1, 5.5)]
    (folder / "job.jsonl").write_text("".join(f"{json.dumps(run)}\n" for run in runs))
    stations = {name: {"position_m": [0, 0, 25], "normal_deg": 0} for name in "ABC"}
    shards = [{"samples": 4}, {"samples": 7}]
    (folder / "index.json").write_text(
        json.dumps({"shards": shards, "render": {"network": {"stations": stations}}})
    )
    accuracy_cost.main(
        [
            "--settings",
            json.dumps({"seed": 1}),
            "--predictions",
            *predictions,
            "--speeds",
            *speeds,
            "--data-jobs",
            str(folder / "job.jsonl"),
            str(folder / "job.jsonl"),
            "--index",
            str(folder / "index.json"),
            "--presets",
            str(folder / "presets.csv"),
            "--schemes",
            str(folder / "schemes.csv"),
            "--out",
            str(folder / "out.csv"),
        ]
    )
    with (folder / "out.csv").open(newline="") as file:
        return {row["scheme"]: row for row in csv.DictReader(file)}


@pytest.fixture
def speeds(tmp_path):
    return [
        speed_of(tmp_path, name, ms)
        for name, ms in (("base", 4.0), ("small", 1.0), ("large", 90.0))
    ]


def test_accuracy_differences_and_costs_are_those_put_in(tmp_path, speeds):
    study = tmp_path / "mine-study/predictions"
    study.mkdir(parents=True)
    trainings = (
        ("small", 9, 5, 12.0),
        ("base", 4, 0, 1.0),
        ("small", 11, 2, 13.0),
        ("base", 4, 1, 1.0),
    )
    paths = [
        run_of(tmp_path, name, wrong, seed=seed, took=took) for name, wrong, seed, took in trainings
    ]
    paths += [run_of(study, "ABC with more", 0, seed=seed, took=90.0) for seed in (3, 4)]
    presets = ["best,both,make best,study/predictions", "quick,small,make small,"]
    rows = written(tmp_path, paths, speeds, presets)
    assert list(rows) == ["base", "small", "both", "large"]
    base, small, both, large = rows.values()
    assert [row["kind"] for row in rows.values()] == ["trained", "trained", "trained", "timed"]
    assert [float(row["unseen_percent"]) for row in (base, small, both)] == [90.0, 75.0, 100.0]
    assert [float(row["seen_percent"]) for row in (base, small, both)] == [90.0, 75.0, 100.0]
    assert [float(row["difference_points"]) for row in (base, small, both)] == [0.0, -15.0, 10.0]
    assert -40 < float(small["low"]) < -15 < float(small["high"]) < 5
    assert float(small["macro_f1_low"]) < 75 < float(small["macro_f1_high"])
    assert [row["seeds"] for row in (base, small)] == ["2", "2"]
    # 72.5 and 77.5 % of the two trainings.
    assert (float(base["spread_points"]), float(small["spread_points"])) == (
        0,
        pytest.approx(12.5**0.5, abs=1e-3),
    )
    assert (base["low"], base["high"]) == ("0", "0")
    assert (small["stations"], small["spectra"], small["network_bytes"]) == ("A", "VT", str(24**2))
    assert (small["steps"], small["train_samples"], float(small["core_s_training"])) == (
        "30",
        "77",
        12.5,
    )
    # Two jobs took 5.5 s each for eleven samples, a second a sample; one station of three is a
    # third of that.
    assert [float(row["core_s_data"]) for row in (base, small, both)] == pytest.approx(
        [77, 77 / 3, 77], rel=1e-5
    )
    assert [float(row["train_ms"]) for row in (base, small, large)] == [3.0] * 3
    assert [row["front"] for row in (base, small, both, large)] == ["yes", "yes", "yes", ""]
    told = [(row["preset"], row["command"]) for row in rows.values()]
    assert told == [("", ""), ("quick", "make small"), ("best", "make best"), ("", "")]
    # A thousand steps of eight samples, three milliseconds each; no accuracy for what was not
    # trained.
    assert float(large["core_s_training"]) == pytest.approx(24.0) and large["unseen_percent"] == ""


def test_the_table_is_the_same_in_whatever_order_the_trainings_come(tmp_path, speeds):
    """An interval draws trainings by their place, so they are put in the order of their seeds
    first.
    """
    wrong = {"base": (4, 25, 13), "small": (9, 31, 2)}
    paths = [
        run_of(tmp_path, name, count, seed=seed)
        for name, counts in wrong.items()
        for seed, count in enumerate(counts)
    ]
    tables = [
        written(tmp_path, order, speeds) for order in (paths, paths[::-1], [*paths[3:], *paths[:3]])
    ]
    assert tables[0] == tables[1] == tables[2]


def test_schemes_of_one_training_have_an_interval_and_no_spread(tmp_path, speeds):
    small = written(tmp_path, [run_of(tmp_path, "base", 4), run_of(tmp_path, "small", 10)], speeds)[
        "small"
    ]
    assert (small["seeds"], small["spread_points"]) == ("1", "")
    # Six of 40 motion models more are called wrong: 15 points.
    assert (
        float(small["low"]) < float(small["difference_points"]) == -15.0 < float(small["high"]) <= 0
    )


def test_trainings_presets_and_measurements_that_do_not_fit_are_refused(tmp_path, speeds):
    base = run_of(tmp_path, "base", 0)
    with pytest.raises(InputError, match=r"schemes\.csv: no row for \['stranger'\]"):
        written(tmp_path, [run_of(tmp_path, "stranger", 0)], speeds)
    with pytest.raises(InputError, match=r"'base': 2, 'small': 1.*expected as many seeds of each"):
        written(
            tmp_path,
            [base, run_of(tmp_path, "base", 0, seed=1), run_of(tmp_path, "small", 0)],
            speeds,
        )
    with pytest.raises(InputError, match=r"presets: scheme 'small', expected one of \['base'\]"):
        written(tmp_path, [base], speeds, ["quick,small,make small,"])
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(InputError, match=r"bad\.json: not a record of speed"):
        written(tmp_path, [base], [str(tmp_path / "bad.json")])
    with pytest.raises(InputError, match=r"bad\.json: not an extended benchmark file"):
        accuracy_cost.sample_seconds([tmp_path / "bad.json"], 1)
    # A job that ended before Snakemake first measured it.
    short = {"rule_name": "echo", "s": 0.1, "cpu_time": "NA", "max_rss": None}
    (tmp_path / "short.jsonl").write_text(json.dumps(short) + "\n")
    assert accuracy_cost.sample_seconds([tmp_path / "short.jsonl"], 1) == 0
    assert not (tmp_path / "out.csv").exists()


def test_a_network_is_timed_on_images_of_all_values():
    images = network_speed._inputs(3, schemes.Scheme("x", (0, 2), (1,)), 64)
    assert (
        images.shape == (3, 2, 64, 64)
        and np.bincount(images.numpy().ravel(), minlength=256).min() > 0
    )
    assert (network_speed._inputs(3, schemes.Scheme("x", (0, 2), (1,)), 64) == images).all()


def test_the_least_time_is_the_least_and_warm_up_is_not_counted():
    from lowalt.machine.timing import least_s

    now = [0.0]
    spans = itertools.chain([9.0, 3.0, 2.0, 4.0], itertools.repeat(5.0))

    def work():
        now[0] += next(spans)

    assert least_s(work, 20.0, lambda: now[0]) == 2.0
    assert next(spans) == 5.0
    spans = iter([30.0])
    assert least_s(work, 20.0, lambda: now[0]) == 30.0


@pytest.mark.parametrize(
    ("limit_s", "batch", "inference_64", "trained"),
    [
        (0.3, 4, 1 / 64, 4),
        # A call of 1 ms leaves no room for 64 samples in 50 ms; a fourth of 8 ms has none for two
        # training samples, nor has a fourth of 20 ms, which is room for one and two thirds.
        (0.05, 4, None, 4),
        (0.008, 4, None, 1),
        (0.02, 4, None, 1),
        # A step is judged by a sample's share of the largest batch timed, since a GPU takes one
        # sample as long as several; where no larger batch fits, by one sample's 1 ms: room for 5
        # samples.
        (0.065, 8, 1 / 64, 8),
        (0.06, 8, None, 4),
    ],
)
def test_a_network_s_times_are_a_sample_s_and_what_takes_too_long_is_left_out(
    monkeypatch, limit_s, batch, inference_64, trained
):
    # A clock that moves by a millisecond whenever it is read: every call takes one, whatever the
    # machine is busy with.
    ticks = iter(range(10**9))
    monkeypatch.setattr(network_speed, "_clock", lambda *_: lambda: 1e-3 * next(ticks))
    scheme = schemes.Scheme("one", (0,), (0,))
    given = with_training(batch=batch, alone=0.5)
    times = network_speed.measure(scheme, given, limit_s)
    assert times["inference_ms_1"] == pytest.approx(1.0) and times["train_batch"] == trained
    assert times["inference_ms_64"] == (inference_64 and pytest.approx(inference_64))
    assert times["train_ms"] == pytest.approx(1 / trained)
    assert times["parameters"] > 1000 and times["steps"] == given["training"]["steps"]
