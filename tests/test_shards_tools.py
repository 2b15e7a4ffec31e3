"""Other people's tools read the shards: the hub's library, Croissant's, SigMF's, and an uploader without internet."""

import json

import numpy as np
import pytest
import yaml

from dataset import build
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet, upload
from lowalt.shards.card import main as card
from lowalt.shards.hub import size_category
from lowalt.shards.sigmf import main as sigmf
from test_shards_card import CONFIG


@pytest.fixture(scope="module", params=["image", "signal"])
def published(request, tmp_path_factory):
    folder = build(tmp_path_factory.mktemp(request.param) / "shards", request.param, inputs=False)
    (folder.parent / "config.yaml").write_text(yaml.safe_dump(CONFIG))
    card(["--index", str(folder / "index.json"), "--config", str(folder.parent / "config.yaml"),
          "--date", "2026-01-31", "--url", "https://example.org/trial"])  # fmt: skip
    return folder


def loaded(folder, tmp_path, monkeypatch, *names):
    """The data set as the hub's library reads it from a folder, no internet asked."""
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    monkeypatch.setenv("HF_DATASETS_OFFLINE", "1")
    datasets = pytest.importorskip("datasets")
    datasets.disable_progress_bars()
    return datasets.load_dataset(*names, cache_dir=str(tmp_path / "cache"))


def test_the_hubs_library_reads_every_protocol_by_the_card(published, tmp_path, monkeypatch):
    shards = ShardSet(published / "index.json")
    numbers = {key.decode(): number for number, key in enumerate(shards.keys.tolist())}
    counts = {"seen": {"train": 12, "validation": 6, "test": 6}, "unseen": {"train": 8, "validation": 4, "test": 8}}
    for protocol, expected in counts.items():
        found = loaded(published, tmp_path, monkeypatch, str(published), protocol)
        assert {split: len(rows) for split, rows in found.items()} == expected
        assert found["test"].features["json"]["label"].names == list(shards.classes)
        for row in found["test"]:
            number = numbers[row["__key__"]]
            assert row["json"] == shards.record(number)
            if shards.kind == "signal":
                stored = np.array(row["npy"], np.float32).view(np.complex64)[..., 0]
                assert (stored == shards.signal(number)).all()
            else:
                assert (np.asarray(row["png"]) == shards.tile(number)).all()


def test_the_cards_front_matter_is_what_the_hub_wants(published):
    front = yaml.safe_load((published / "README.md").read_text().split("---")[1])
    assert front["language"] == ["en"] and front["size_categories"] == ["n<1K"]
    assert [config["config_name"] for config in front["configs"]] == ["seen", "unseen"]
    assert front["configs"][0]["default"] is True
    words = [size_category(count) for count in (0, 999, 1000, 24_000, 1_440_000, 10**9)]
    assert words == ["n<1K", "n<1K", "1K<n<10K", "10K<n<100K", "1M<n<10M", "n>1B"]


def test_croissant_is_of_version_1_1_and_has_no_fault(published, mlcroissant):
    text = json.loads((published / "croissant.json").read_text())
    assert text["conformsTo"].endswith("/1.1")
    data = mlcroissant.Dataset(str(published / "croissant.json"))
    assert not data.metadata.issues.errors and not data.metadata.issues.warnings
    assert len(list(data.records("samples"))) == 24
    shards = ShardSet(published / "index.json")
    labels = dict(zip((key.decode() for key in shards.keys.tolist()), shards.labels.tolist(), strict=True))
    rows = list(data.records("labelled"))
    assert {row["labelled/key"].decode(): row["labelled/label"] for row in rows} == labels
    for row in rows if shards.kind == "image" else []:
        number = shards.keys.tolist().index(row["labelled/key"])
        assert (np.asarray(row["labelled/content"]) == shards.tile(number)).all()


def test_zenodo_takes_the_metadata(published):
    text = (published / ".zenodo.json").read_text()
    found = json.loads(text)
    assert text == json.dumps(found, indent=1) + "\n"
    assert found["upload_type"] == "dataset" and found["license"] == "mit" and found["creators"][0]["name"]
    assert set(found) >= {"title", "description", "access_right", "keywords"}


def test_sigmf_recordings_hold_every_signal_with_its_annotation(published, tmp_path):
    shards = ShardSet(published / "index.json")
    arguments = ["--index", str(published / "index.json"), "--out", str(tmp_path)]
    if shards.kind == "image":
        with pytest.raises(InputError, match="expected 'signal'"):
            sigmf(arguments)
        return
    library = pytest.importorskip("sigmf")
    sigmf(arguments)
    network = shards.index["render"]["network"]
    for place, station in enumerate(network["stations"]):
        recording = library.sigmffile.fromfile(str(tmp_path / f"{station}.sigmf-meta"))
        recording.validate()
        assert recording.get_global_field("core:datatype") == "cf32_le"
        assert recording.get_global_field("core:sample_rate") == 1 / network["symbol_interval_s"]
        assert recording.get_capture_info(0)["core:frequency"] >= network["carrier_hz"]
        annotations = recording.get_annotations()
        assert len(annotations) == len(shards)
        for number in (0, 5, len(shards) - 1):
            note = annotations[number]
            signal = recording.read_samples(note["core:sample_start"], note["core:sample_count"])
            assert (signal == shards.signal(number)[place]).all()
            assert note["lowalt:key"] == shards.keys[number].decode()


class Client:
    """Stands in for the hub and notes what is asked of it."""

    def __init__(self):
        self.calls = []

    def create_repo(self, *names, **options):
        self.calls.append(("create", names, options))

    def upload_folder(self, **options):
        self.calls.append(("upload", options))


def test_an_upload_sends_all_files_of_a_whole_data_set(published, monkeypatch):
    client = Client()
    count = upload.upload(published / "index.json", "somebody/echoes", client)
    (_, names, options), (_, sent) = client.calls
    assert names == ("somebody/echoes",) and options["repo_type"] == "dataset" and options["private"]
    assert len(sent["allow_patterns"]) == count == 6 * 2 + 6
    assert {"README.md", "SHA256SUMS", "index.json", ".zenodo.json"} <= set(sent["allow_patterns"])
    with pytest.raises(InputError, match="USER/NAME"):
        upload.upload(published / "index.json", "echoes", client)
    monkeypatch.delenv("HF_TOKEN", raising=False)
    with pytest.raises(InputError, match="HF_TOKEN"):
        upload.main(["--index", str(published / "index.json"), "--repository", "somebody/echoes"])
    stray = published / "notes.txt"
    stray.write_text("no part of it")
    with pytest.raises(InputError, match="no part of the data set"):
        upload.upload(published / "index.json", "somebody/echoes", client)
    stray.unlink()
    assert len(client.calls) == 2


def test_the_real_client_is_asked_with_the_token_and_nothing_is_sent(published, monkeypatch):
    hub = pytest.importorskip("huggingface_hub")
    seen = []
    monkeypatch.setenv("HF_TOKEN", "hf_token_of_nobody")
    monkeypatch.setattr(hub.HfApi, "create_repo", lambda self, *names, **options: seen.append((self.token, names)))
    monkeypatch.setattr(hub.HfApi, "upload_folder", lambda self, **options: seen.append(options["repo_id"]))
    upload.main(["--index", str(published / "index.json"), "--repository", "somebody/echoes"])
    assert seen == [("hf_token_of_nobody", ("somebody/echoes",)), "somebody/echoes"]
