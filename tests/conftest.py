"""Fixtures that several test files share, and in which order files of tests run."""

import gc
import math

import pytest

import kept_records
from lowalt.files import yaml_files
from lowalt.targets import records
from meshes import write_bird, write_quad
from skips import Skips

# Files that take long, the longest first. Two processes share the files of tests, one file at a
# time: a long file that begins last would keep one of them alone at the end.
LONG = (
    "test_workflow",
    "test_workflow_reruns",
    "test_docs",
    "test_contributing",
    "test_recognition_resume",
    "test_benchmark",
    "test_benchmark_commands",
    "test_strangers_package",
    "test_studies",
    "test_wheel",
    "test_house",
    "test_recognition_training",
    "test_recognition_ranks",
    "test_bytes",
    "test_bytes_scenes",
    "test_town",
    "test_echo",
    "test_physics",
    "test_inspection",
    "test_recordings_unseen",
    "test_dataset",
    "test_recognition_tables_cells",
    "test_core_alone",
    "test_container",
    "test_classes",
    "test_mesh",
    "test_measured",
)


records.merge = kept_records.once(records.merge)
yaml_files._parsed = kept_records.once_of_repository(yaml_files._parsed)

# Imports make millions of objects that stay: looking through them for garbage took a tenth of the
# tests' time.
gc.disable()


def pytest_addoption(parser):
    """An option of this suite."""
    parser.addoption(
        "--strict-skips",
        action="store_true",
        help="fail where a test is skipped for an unlisted reason",
    )


def pytest_configure(config):
    """Count skips in the process that collects all reports."""
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Skips())


def pytest_collection_modifyitems(items):
    """Long files first; `--no-loadscope-reorder` lets pytest-xdist keep this order."""
    place = {name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.path.stem, len(LONG)))


def pytest_collection_finish():
    """From here on look for garbage among what tests make alone."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def kept_clouds():
    """Data sets and explanations of equal records share their clouds; tests of clouds do not."""
    from lowalt.scene import explanation
    from lowalt.shards import dataset

    places = ((dataset, "made_cloud"), (dataset, "made_surfaces"), (explanation, "make"))
    with pytest.MonkeyPatch.context() as patch:
        for module, name in places:
            patch.setattr(module, name, kept_records.once_without_files(getattr(module, name)))
        yield


@pytest.fixture
def mlcroissant(monkeypatch, tmp_path):
    """Croissant's reference implementation, unpacking into a folder of the test's own.

    It keeps unpacked archives by their relative names, so it would take one data set's shards for
    another's.
    """
    library = pytest.importorskip("mlcroissant")
    from mlcroissant._src.operation_graph.operations import extract

    monkeypatch.setattr(extract, "EXTRACT_PATH", type(extract.EXTRACT_PATH)(tmp_path / "croissant"))
    return library


@pytest.fixture
def always_approximate(monkeypatch):
    """Let the echo use the cheap plan of a tolerance even where the exact mode would be as fast."""
    from lowalt.echo import refine

    monkeypatch.setattr(refine, "PROBE_COST", -math.inf)


@pytest.fixture
def quad(tmp_path):
    """A folder with the meshes of a made quadcopter."""
    return write_quad(tmp_path)


@pytest.fixture
def bird(tmp_path):
    """A folder with the meshes of a made bird."""
    return write_bird(tmp_path)


@pytest.fixture(scope="session")
def views(tmp_path_factory):
    """A file of samples that a few steps of training tell apart. No test writes to it."""
    # torch is imported only by the tests that train.
    from trainings import write_views

    return write_views(tmp_path_factory.mktemp("views") / "views.npz")


@pytest.fixture(scope="session")
def trained(views, tmp_path_factory):
    """The folder of a finished training on `views`. No test writes to it."""
    from trainings import train, with_training

    folder = tmp_path_factory.mktemp("model")
    train(views, folder, with_training(steps=80, validate_every=40, ema=0.95))
    return folder
