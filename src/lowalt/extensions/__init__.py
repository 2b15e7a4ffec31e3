"""The extensions that come with lowalt, as its entry points of the group `lowalt.extensions`
declare them.

The core imports none of them: a folder here can leave together with its declaration.
"""

from lowalt.config.core_commands import Command
from lowalt.config.extensions import AddedEffect, Extension

_HERE = "lowalt.extensions"

TOWN = Extension(
    commands={
        "scene": Command(
            f"{_HERE}.town.scene",
            "your own town: look at a file of buildings, draft the scene",
            "lowalt scene new town.geojson --out town.yaml",
        )
    },
    effects={"town": AddedEffect(f"{_HERE}.town.town", "channel", after="walls")},
)
"""Paths of waves among buildings."""

DRAFTING = Extension(
    commands={
        "target": Command(
            f"{_HERE}.drafting.target",
            "your own mesh or robot: look, draft a record, make its cloud",
            "lowalt target inspect inputs/mydrone.stl",
        )
    },
    functions={"draft_target": f"{_HERE}.drafting.scaled"},
    meshes={
        ".glb": f"{_HERE}.drafting.mesh_glb",
        ".ply": f"{_HERE}.drafting.mesh_ply",
    },
)
"""Drafts of records from meshes, robots' descriptions and data sheets, and further formats of
meshes.
"""

RECORDINGS = Extension(
    commands={
        "recording": Command(
            f"{_HERE}.recordings.recording",
            "a recording of your own radar: look, draft its record, train a recogniser",
            "lowalt recording inspect walk.bin --carrier 24e9 --rate 12000",
        )
    },
    readers={".yaml": f"{_HERE}.recordings.predicted"},
    functions={"inspect_recording": f"{_HERE}.recordings.file_inspection"},
)
"""Recordings of radars, and their twins."""

BENCHMARK = Extension(
    commands={
        "benchmark": Command(
            f"{_HERE}.benchmark.benchmark",
            "lowalt-40: data, tracks, scores of submissions, table of baselines",
            "lowalt benchmark score predictions.csv --track unseen",
        )
    },
    comparisons={"methods of the benchmark": f"{_HERE}.benchmark.compared_methods"},
    sections={"benchmark": f"{_HERE}.benchmark.benchmark_results"},
)
"""The benchmark lowalt-40."""

FORMATS = Extension(
    stores=dict.fromkeys(("http", "https"), f"{_HERE}.formats.web_files"),
    models={"zoo": f"{_HERE}.formats.zoo_files"},
    exports={".onnx": f"{_HERE}.formats.onnx_export"},
)
"""Files for other tools: data sets on web servers, the zoo of small models, ONNX, and SigMF by
`python -m lowalt.extensions.formats.sigmf`.
"""
