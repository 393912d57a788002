"""Columns of published tables: each has a description, those of runs a key."""

import pytest

from trackdyn.inputs.errors import InputError
from trackdyn.measure.columns import table_schema


def test_the_dictionary_describes_columns_and_refuses_unknown_ones():
    schema = table_schema(["run", "rms_g", "ring_peak_n", "left_areas", "passages"])
    assert [(field["type"], field["unit"]) for field in schema["fields"]] == [
        ("string", ""), ("number", "g"), ("number", "N"), ("string", ""), ("integer", "1"),
    ]  # fmt: skip
    assert (
        schema["fields"][2]["description"]
        == "largest normal force on a link on the ring in a passage, mean over passages"
    )
    assert schema["primaryKey"] == ["run"]
    assert [field.get("standardError") for field in schema["fields"][1:4]] == [
        "rms_error_g", "ring_peak_error_n", "what was visited at all, no number",
    ]  # fmt: skip
    with pytest.raises(InputError, match="up_peak_n has no description"):
        table_schema(["up_peak_n"])
