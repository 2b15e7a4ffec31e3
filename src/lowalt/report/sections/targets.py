"""Section: the targets' clouds, their motion and their sources."""

from pathlib import Path

from lowalt.common.files import sha256
from lowalt.motion import read_table
from lowalt.report.figures.motion_strip import motion_strip
from lowalt.report.figures.style import embedded
from lowalt.report.run import ReportedRun
from lowalt.report.tables import cloud_seconds
from lowalt.targets.cloud import Cloud, read
from lowalt.targets.dimensions import estimates


def cloud_rows(clouds: dict[str, Cloud], published: dict[str, dict], seconds: dict[str, float]) -> list[dict]:
    """Return one row a cloud file: subtype, category, group, source, points, the published count, time, checksum.

    clouds: by file; seconds: time of each cloud by file name without its ending. `foot_speed` is a walker's or runner's
    mean speed of the standing foot.
    """
    rows = []
    for path, cloud in clouds.items():
        row = published[cloud.subtype]
        rows.append(
            {
                "subtype": cloud.subtype,
                "category": cloud.category,
                "group": row["unseen_protocol"],
                "source": cloud.record["source"],
                "estimates": "{} of {}".format(*estimates(cloud.record)),
                "points": len(cloud.points),
                "published": row["points_in_published_cloud_approx"],
                "seconds": seconds.get(Path(path).stem, float("nan")),
                "foot_speed": cloud.record.get("stance_foot_speed_mps"),
                "sha256": sha256(path),
            }
        )
    return rows


def values(run: ReportedRun) -> dict:
    """Return the table of clouds and the pictures of clouds and motion."""
    clouds = {path: read(path) for path in run.inputs.paths("clouds")}
    return {
        "rows": cloud_rows(clouds, run.targets, cloud_seconds(run.inputs.paths("benchmarks"))),
        "gallery": embedded(run.inputs.path("gallery").read_bytes()),
        "strip": embedded(motion_strip(list(clouds.values()), read_table(run.inputs.path("motion")))),
    }
