"""The schema of records: it knows the keys that the code knows and describes each.

The page of keys shows them.
"""

import pytest
from key_pages import records_page

from lowalt.files.errors import InputError
from lowalt.targets import bird, record_schema, uav
from lowalt.targets.builtin import MODULES
from lowalt.targets.make import SOURCES
from lowalt.targets.mesh_files import UNITS_M
from lowalt.targets.mesh_record import ALL_AXES, SIZES

SCHEMA = record_schema.schema()


def test_sections_are_the_sources_and_their_keys_those_of_the_code():
    assert set(SCHEMA["sources"]) == {record_schema.COMMON, *SOURCES}
    models = SCHEMA["models"]
    assert {model["like"] for model in models.values()} == set(MODULES)
    assert {name for name, model in models.items() if model["like"] == "UAV"} == set(uav.LAYOUTS)
    assert {key for model in models.values() for key in model.get("keys", [])} < set(
        SCHEMA["sources"]["builtin"]["properties"]
    )
    kinds = {kind for name in models for kind in record_schema.figures(name).values()}
    assert kinds == {"length", "ratio", "offset", "count", "whole"}
    definitions = SCHEMA["$defs"]
    assert definitions["unit"]["anyOf"][0]["enum"] == list(UNITS_M)
    assert set(definitions["flap"]["properties"]) == set(bird.FLAP)
    mesh = SCHEMA["sources"]["mesh"]["properties"]
    assert mesh["size_is"]["enum"] == [*SIZES, ALL_AXES]


def test_the_page_of_keys_describes_every_key_and_every_figure():
    page = records_page(SCHEMA)
    for section in SCHEMA["sources"].values():
        for name, key in section["properties"].items():
            assert f"| `{name}`" in page and key["description"] in page
    for name in SCHEMA["models"]:
        assert f"| {name} |" in page
        assert all(
            f"`{figure}` ({kind})" in page for figure, kind in record_schema.figures(name).items()
        )
    bare = SCHEMA | {"sources": {"gait": {"properties": {"gait": {"type": "string"}}}}}
    with pytest.raises(InputError, match="gait has no description"):
        records_page(bare)
