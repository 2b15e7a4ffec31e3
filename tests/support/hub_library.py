"""The hub's library reads data sets from folders."""

import pytest


def loaded(folder, tmp_path, monkeypatch, *names):
    """A data set, or its protocol of this name, as the library reads it; no internet is asked."""
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    monkeypatch.setenv("HF_DATASETS_OFFLINE", "1")
    datasets = pytest.importorskip("datasets")
    datasets.disable_progress_bars()
    return datasets.load_dataset(str(folder), *names, cache_dir=str(tmp_path / "cache"))
