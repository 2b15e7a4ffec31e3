"""The machine in words: the names that the system and the driver give, and no comma, since it
stands in CSV cells.
"""

from types import SimpleNamespace

import pytest

from lowalt.machine import hardware


@pytest.mark.parametrize(
    ("tool", "status", "said", "wanted"),
    [
        (None, 0, "NVIDIA H200\n", "no GPU"),
        ("/bin/nvidia-smi", 0, " NVIDIA H200, NVL \nNVIDIA A100\n", "NVIDIA H200  NVL"),
        ("/bin/nvidia-smi", 9, "NVIDIA-SMI has failed\n", "no GPU"),
        ("/bin/nvidia-smi", 0, "\n", "no GPU"),
    ],
)
@pytest.mark.parametrize("hidden", [None, "", "-1"])
def test_a_machine_is_named_by_processor_cores_memory_and_first_gpu(
    tool, status, said, wanted, hidden, monkeypatch
):
    if hidden is None:
        monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    else:
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", hidden)
        wanted = "no GPU"
    monkeypatch.setattr(hardware.shutil, "which", lambda name: tool)
    asked = SimpleNamespace(returncode=status, stdout=said)
    monkeypatch.setattr(hardware.subprocess, "run", lambda line, **options: asked)
    monkeypatch.setattr(hardware, "processor", lambda: "AMD EPYC, 9B45")
    monkeypatch.setattr(
        hardware.os, "sched_getaffinity", lambda process: {3, 4, 7} if process == 0 else {1}
    )
    monkeypatch.setattr(
        hardware.os, "sysconf", {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 24 * 2**18}.get
    )
    assert hardware.describe() == f"AMD EPYC  9B45; 3 cores; 24 GiB; {wanted}"
