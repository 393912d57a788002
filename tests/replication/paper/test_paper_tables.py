"""The article in a reader's hand. Every number that is filled in here is invented."""

import re
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
import yaml

from replication.paper.paper_tables import Area
from replication.paper.printed_rig import write_printed_rig
from trackdyn.errors import InputError
from trackdyn.rig.groove import Groove, equal_pitch_radius
from trackdyn.rig.rig import load_rig, parameter_table

ROOT = Path(__file__).parents[3]
SHIPPED = ROOT / "config" / "rigs" / "paper" / "tables.yaml"
RIG = load_rig(ROOT / "config" / "rigs" / "paper.yaml")
GROOVE = RIG.groove_profile
PRINTED = {"O": "mm", "r": "mm", "theta": "deg"}


def written_out(groove: Groove) -> dict[int, dict[str, float]]:
    """A groove as the areas of Table 1 have it, in m and rad."""
    columns = np.column_stack([groove.centre, groove.radius, groove.direction, groove.half_angle])
    return {area: dict(zip(Area.model_fields, row, strict=True)) for area, row in enumerate(columns.tolist(), 1)}


@pytest.fixture
def fill(tmp_path):
    """Write a rig beside a table with invented cells by their dotted name; returns the rig's file."""

    def write(cells=None, areas=None, units=None):
        data = yaml.safe_load(SHIPPED.read_text(encoding="utf-8"))
        if areas is not None:
            data["table1"]["areas"] = areas
        data["table1"]["units"] |= units or {}
        for key_path, value in (cells or {}).items():
            section = data
            *sections, last = key_path
            for key in sections:
                section = section.setdefault(key, {}) if key in section or len(sections) > 2 else section[key]
            section[last] = value
        (tmp_path / "paper").mkdir(exist_ok=True)
        (tmp_path / "paper" / "tables.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
        rig = tmp_path / "rig.yaml"
        rig.write_text((ROOT / "config" / "rigs" / "paper.yaml").read_text(encoding="utf-8"), encoding="utf-8")
        return rig

    return write


def printed(rig):
    """The file of a rig with the cells beside it."""
    write_printed_rig(out := rig.parent / "printed.yaml", rig.parent / "paper" / "tables.yaml", rig)
    return out


def parameter(name, value):
    return {("parameters", name, "value"): value}


def rounded(areas, decimals=2):
    """A groove in mm and degrees with so many decimals, as an article would print it."""
    scale = {"O_x": 1e3, "O_y": 1e3, "r": 1e3, "theta": 180 / np.pi}
    return {
        area: {
            name: round(value * scale.get(name, 1.0), decimals + (name[0] == "u") * 2) for name, value in row.items()
        }
        for area, row in areas.items()
    }


def short(areas, keep, columns=("O_x", "O_y", "r")):
    return {area: {name: row[name] for name in columns} for area, row in areas.items() if area in keep}


@pytest.mark.parametrize("keep", [range(1, 11), range(1, 6), range(6, 11)])
def test_our_groove_written_out_as_table_1_is_read_back_as_the_same_contour(fill, keep):
    areas = written_out(GROOVE)
    areas = areas if len(keep) == 10 else short(areas, keep)
    groove = load_rig(printed(fill(areas=areas))).groove_profile
    assert np.abs(groove.profile() - GROOVE.profile()).max() < 1e-12
    assert np.abs(groove.half_angle - GROOVE.half_angle).max() < 1e-12
    assert abs(groove.addendum - GROOVE.addendum) < 1e-12


def test_another_groove_of_table_1_becomes_the_groove_whatever_the_rig_had(fill):
    """The contour stays where it is printed although pins and arcs of the connector are others."""
    other = RIG.changed(groove__r2=0.06, groove__slope_tip=50.0, groove__seat_depth=0.003).groove_profile
    cells = (
        parameter("chain.connector_radius", 0.025) | parameter("L_C", 0.0599) | parameter("r_a", float(other.addendum))
    )
    rig = load_rig(printed(fill(cells, areas=written_out(other))))
    assert rig.chain.connector_radius == 0.025
    assert np.abs(rig.groove_profile.profile() - other.profile()).max() < 1e-12
    assert np.abs(rig.groove_profile.profile() - GROOVE.profile()).max() > 1e-3
    kinds = parameter_table(printed(fill(cells, areas=written_out(other)))).set_index("name")
    assert kinds.loc["profile.arcs", "kind"] == "printed" and "groove.r2" not in kinds.index
    assert "Table 1" in kinds.loc["profile.arcs", "source"] and "tables.yaml" in kinds.loc["profile.arcs", "source"]


def test_a_table_that_is_printed_with_two_decimals_joins_exactly(fill):
    areas = rounded(written_out(GROOVE))
    groove = load_rig(printed(fill(areas=areas, units=PRINTED))).groove_profile
    gap = np.abs([groove.arc(j, 2)[-1] - groove.arc(j + 1, 2)[0] for j in range(1, 10)]).max()
    assert gap < 1e-15
    assert 1e-9 < np.abs(groove.centre - GROOVE.centre).max() < 2e-5  # of cells that are rounded to 1e-5 m
    assert np.abs(groove.radius[1:9] - GROOVE.radius[1:9]).max() <= 5.0001e-6


@pytest.mark.parametrize(
    "name, value, unit",
    [("bushing.stiffness", 321.0, "N m/rad"), ("chain.link_mass", 11.5, "kg"), ("idler.x", -1.2, "m")],
)
def test_a_filled_parameter_replaces_ours_and_says_that_it_is_printed(fill, name, value, unit):
    path = printed(fill(parameter(name, value)))
    row = parameter_table(path).set_index("name").loc[name]
    assert load_rig(path).value(name) == value != RIG.value(name)
    assert (row["value"], row["unit"], row["kind"]) == (value, unit, "printed") and "tables.yaml" in row["source"]


def test_axial_lengths_are_those_of_eq_19(fill):
    contact = load_rig(printed(fill(parameter("t_S", 0.044) | parameter("t_C", 0.06)))).tooth_contact
    assert (contact.contact_length, contact.axial_overhang) == pytest.approx((0.044, 0.008))
    assert (0.044 + 0.06) / 2 - contact.axial_overhang == pytest.approx(contact.contact_length)


def areas_with(area, name, value, decimals=None):
    areas = deepcopy(written_out(GROOVE) if decimals is None else rounded(written_out(GROOVE), decimals))
    areas[area][name] = value
    return areas


WRONG = {
    "one radius alone": (dict(areas={3: {"r": 0.03}}), ["table1.areas.1.O_x = null", "areas 1 to 5", "or of all"]),
    "a right flank without one cell": (
        dict(areas=areas_with(8, "O_y", None)),
        ["table1.areas.8.O_y = null", "of areas 6 to 10"],
    ),
    "arcs that do not join": (
        dict(areas=short(areas_with(2, "r", 51.0, 2), range(1, 6)), units=PRINTED),
        ["table1: areas 1 to 5: arcs 1 and 2 miss each other", "would be tangent"],
    ),
    "a right flank that does not join": (
        dict(areas=areas_with(9, "r", 0.06)),
        ["table1: areas 10 to 6: arcs 1 and 2 miss each other"],
    ),
    "another spread angle": (
        dict(areas=areas_with(3, "theta", 0.3)),
        ["table1.areas.3.theta = 0.3", "centres and radii"],
    ),
    "a unit of its own": (dict(units={"O": "cm"}), ["table1.units.O = 'cm'", "'m' or 'mm'"]),
    "another addendum": (
        dict(cells=parameter("r_a", 0.4), areas=written_out(GROOVE)),
        ["parameters.r_a = 0.4 m", "Table 1, 0.329"],
    ),
    "an addendum alone": (dict(cells=parameter("r_a", 0.33)), ["parameters.r_a", "without Table 1"]),
    "a groove too narrow for the connector": (
        dict(cells=parameter("chain.connector_radius", 0.0335), areas=written_out(GROOVE)),
        [f"a concave area of radius {RIG.groove.r3:.6g} m", "chain.connector_radius = 0.0335 m"],
    ),
    "a pitch that is not link and connector": (
        dict(cells=parameter("pitch", 0.17) | parameter("chain.link_length", 0.1) | parameter("L_C", 0.062)),
        ["parameters.pitch = 0.17 m is not that of link and connector, 0.1 + 0.062 m", "accepted"],
    ),
    "one axial length": (dict(cells=parameter("t_S", 0.05)), ["parameters.t_C = null", "Eq. 19"]),
    "one computing time": (dict(cells={("table2", "proposed"): 5.0}), ["table2.recurdyn = null", "both times"]),
    "a negative length": (dict(cells=parameter("L_C", -0.06)), ["parameters.L_C = -0.06 m:"]),
    "a misspelt cell": (
        dict(cells={("table3", "speeds", 115, "rms_experimental"): 1.0}),
        ["table3.speeds.115.rms_experimental is not a known parameter"],
    ),
    "a misspelt parameter": (
        dict(cells={("parameters", "chain.link_mas"): {"value": 1.0, "unit": "kg", "name": "m", "place": "Fig. 2"}}),
        ["'chain.link_mas' is not a parameter of this rig", "'chain.link_mass'"],
    ),
    "another unit": (
        dict(cells=parameter("chain.link_mass", 9.0) | {("parameters", "chain.link_mass", "unit"): "g"}),
        ["parameters.chain.link_mass has the unit 'g'", "'kg'"],
    ),
    "a word": (dict(cells=parameter("chain.link_mass", "ten")), ["chain.link_mass = 'ten'", "a number in kg"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_tables_that_cannot_be_used_end_in_one_sentence(fill, case):
    cells, parts = WRONG[case]
    path = fill(**cells)
    with pytest.raises(InputError) as caught:
        printed(path)
    assert not (path.parent / "printed.yaml").exists()
    said = str(caught.value)
    assert str(path.parent / "paper" / "tables.yaml") in said and "\n" not in said
    for words in parts:
        assert words in said, said


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("chain.link_mass", 9500.0, r"chain\.link_mass = 9500 kg is not within 6 to 20"),
        ("bushing.stiffness", 180000.0, r"bushing\.stiffness = 180000 N m/rad is not within 100 to 2500"),
        ("chain.link_mass", 9.5, None),
    ],
)
def test_a_cell_outside_the_range_of_what_it_replaces_is_named(fill, name, value, said):
    """A wrong unit, most of all."""
    rig = fill({("parameters", name, "value"): value})
    out = rig.parent / "printed.yaml"
    sentences = write_printed_rig(out, rig.parent / "paper" / "tables.yaml", rig)
    assert load_rig(out).value(name) == value and len(sentences) == (said is not None)
    assert said is None or re.search(said, sentences[0])


def test_a_length_without_measure_is_refused(fill):
    with pytest.raises(InputError, match=r"parameters\.pitch = .*1e\+300.*: must be a number between 0 and 1000 m"):
        load_rig(printed(fill({("parameters", "pitch", "value"): 1e300})))


def test_lengths_of_link_and_connector_become_the_equal_pitch(fill):
    for cells in (
        parameter("chain.link_length", 0.098) | parameter("L_C", 0.0605),
        parameter("pitch", 0.1585) | parameter("L_C", 0.0605),
        parameter("chain.link_length", 0.098) | parameter("pitch", 0.1585),
    ):
        rig = load_rig(printed(fill(cells)))
        assert rig.chain.link_length == pytest.approx(0.098, abs=1e-15)
        assert rig.connector_length == pytest.approx(0.0605, abs=1e-12)
        polygonal = equal_pitch_radius(13, 0.098, 0.0605, rig.chain.link_thickness)["polygonal"]
        assert rig.sprocket.equal_pitch_radius == pytest.approx(polygonal, abs=1e-12)
    circle = load_rig(printed(fill(parameter("r_p", 0.331))))
    assert circle.pin_circle == pytest.approx(0.331, abs=1e-12) and circle.chain.link_length == RIG.chain.link_length
    both = load_rig(printed(fill(parameter("r_p", circle.pin_circle) | parameter("L_C", circle.connector_length))))
    assert both.chain.link_length == pytest.approx(RIG.chain.link_length, abs=1e-9)
