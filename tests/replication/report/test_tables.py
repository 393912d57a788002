"""Tables as they are read: three digits, headings of two lines, units; and what they add up to."""

import shutil

import pytest

from replication.report.costs import cost_table
from trackdyn.errors import InputError
from trackdyn.measure.columns import table_schema


def benchmark(folder, name, wall):
    path = folder / f"{name}.tsv"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"s\tmax_rss\tcpu_time\n{wall}\t100\t{0.5 * wall}\n", encoding="utf-8")


def test_costs_have_a_total_that_leaves_out_what_is_asked_for_by_name(tmp_path):
    took = {"simulate/115rpm": 2.0, "simulate/210rpm": 3.0, "page": 9.0, "trade": 900.0, "trade/data": 1.0}
    took |= {"extremes": 700.0, "extremes/drag": 7.0, "pictures": 90.0}
    for name, wall in (took | {"short/trade": 1.0, "short/trade/data": 2.0}).items():
        benchmark(tmp_path, name, wall)
    table = cost_table(tmp_path)
    by_name = ["trade", "extremes", "pictures"]
    run = ["page", "simulate", "short/trade", "all of a run"]
    assert list(table["rule"]) == [*run, *(f"{name}, by name" for name in by_name)]
    assert list(table["jobs"]) == [1, 2, 2, 5, 2, 2, 1]
    assert list(table["wall_s"]) == [9.0, 5.0, 3.0, 17.0, 901.0, 707.0, 90.0]
    for name in by_name:
        shutil.rmtree(tmp_path / name, ignore_errors=True)
        (tmp_path / f"{name}.tsv").unlink()
    assert list(cost_table(tmp_path)["rule"]) == ["page", "simulate", "short/trade", "all of a run"]
    assert cost_table(tmp_path / "nothing").empty


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
