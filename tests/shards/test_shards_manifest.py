"""A manifest of a run: which lines are taken, and which stages a comparison leaves out."""

import subprocess

import pytest

from lowalt.files.errors import InputError
from lowalt.shards import manifest

SUM = "0123456789abcdef" * 4
FILES = (
    "clouds/a.npz",
    "motion/seen-00000.csv",
    "echo/A/seen-00000.npy",
    "noisy/seen-00000.npy",
    "shards/index.json",
)


@pytest.fixture
def options(tmp_path):
    """The options of a run and of its manifest."""
    for name in FILES:
        (tmp_path / "run" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "run" / name).write_text(name)
    given = ["--run", str(tmp_path / "run"), "--manifest", str(tmp_path / "run.sha256")]
    manifest.main(["write", *given])
    return given


def refused(capsys, *words: str) -> list[str]:
    """What a check says that ends with status 1."""
    with pytest.raises(SystemExit, match="1"):
        manifest.main(["check", *words])
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (f"{SUM[:-1]}  clouds/a.npz", "expected a SHA-256"),
        (f"{SUM}0  clouds/a.npz", "expected a SHA-256"),
        (f"{SUM.upper()}  clouds/a.npz", "expected a SHA-256"),
        (f"{SUM}  ", "expected a SHA-256, two spaces and a file"),
        (f"{SUM} clouds/a.npz", "expected a SHA-256"),
        (f"{SUM}  cloud/a.npz", "'cloud/a.npz', expected a file of one of"),
        (f"{SUM}  ../clouds/a.npz", "expected a file of one of"),
    ],
)
def test_a_line_without_a_whole_checksum_and_a_stage_s_file_is_named(tmp_path, line, words):
    path = tmp_path / "run.sha256"
    path.write_text(f"{SUM}  clouds/b.npz\n{line}\n")
    with pytest.raises(InputError, match=rf"run\.sha256, line 2: .*{words}"):
        manifest.read(path)
    path.write_text(f"{SUM}  clouds/b.npz\n")
    assert manifest.read(path) == {"clouds/b.npz": SUM}


def test_stages_that_left_no_files_are_passed_over_where_they_are_named_alone(
    tmp_path, options, capsys
):
    for name in FILES[2:4]:
        (tmp_path / "run" / name).unlink()
    manifest.main(["check", *options, "--without", "echo", "noise"])
    assert "all 5 files are equal" in capsys.readouterr().out
    for without, missing in (
        (["echo"], [f"noise: {FILES[3]} is missing"]),
        ([], [f"echo: {FILES[2]} is missing", f"noise: {FILES[3]} is missing"]),
    ):
        assert refused(capsys, *options, "--without", *without) == missing
    # A file that is there is compared all the same.
    (tmp_path / "run" / FILES[3]).write_text("other")
    told = refused(capsys, *options, "--without", "echo", "noise")
    assert told == [f"noise: {FILES[3]} differs"]


def test_faults_are_told_in_the_order_of_the_stages_and_the_first_stage_by_its_name(
    tmp_path, options, capsys
):
    manifest.main(["check", *options])
    assert "all 5 files are equal" in capsys.readouterr().out
    (tmp_path / "run" / FILES[3]).write_text("other")
    (tmp_path / "run" / FILES[4]).unlink()
    (tmp_path / "run/motion/unseen-00000.csv").write_text("more")
    with pytest.raises(SystemExit):
        manifest.main(["check", *options])
    said = capsys.readouterr()
    assert said.out.splitlines() == [
        "motion: motion/unseen-00000.csv is not in the manifest",
        f"noise: {FILES[3]} differs",
        f"shards: {FILES[4]} is missing",
    ]
    assert said.err.strip() == "first stage that differs: motion"
    with pytest.raises(InputError, match="folder of a run"):
        manifest.text(tmp_path / "nowhere")


def test_a_manifest_by_groups_has_the_checksums_of_sha256sum_and_notices_each_change(
    tmp_path, options, capsys
):
    run = tmp_path / "run"
    for name in (
        "clouds/b.npz",
        "motion/seen-00001.csv",
        "shards/seen-train-00000.tar",
        "shards/seen-train-00001.tar",
    ):
        (run / name).parent.mkdir(exist_ok=True)
        (run / name).write_text(name)
    manifest.main(["write", *options, "--by-groups"])
    groups = (
        "clouds/*.npz motion/seen-*.csv echo/A/seen-*.npy noisy/seen-*.npy shards/seen-train-*.tar"
        " shards/index.json"
    )
    assert list(manifest.read(tmp_path / "run.sha256")) == groups.split()
    for pattern, digest in manifest.read(tmp_path / "run.sha256").items():
        again = "| sha256sum" if "*" in pattern else ""
        told = subprocess.run(
            f"sha256sum {pattern} {again}", shell=True, cwd=run, capture_output=True, text=True
        )
        assert told.stdout.split()[0] == digest, pattern
    manifest.main(["check", *options])
    assert "all 6 groups are equal" in capsys.readouterr().out
    (run / "motion/seen-00001.csv").unlink()
    (run / "noisy/unseen-00000.npy").write_text("more")
    (run / "shards/seen-train-00001.tar").write_text("other")
    assert refused(capsys, *options) == [
        "motion: motion/seen-*.csv differs",
        "noise: noisy/unseen-00000.npy is not in the manifest",
        "shards: shards/seen-train-*.tar differs",
    ]
