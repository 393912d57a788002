"""Every parameter of the rig with value, unit, kind and source, read from YAML and validated.

Each entry of the file is ``{value, unit, kind, source}``. The unit must be the one named here: units
are never converted silently. The kind says where the number comes from: ``printed`` in the paper,
``derived`` from printed numbers, ``assumed``, or ``fitted`` (its source says to what).
"""

import re
from functools import cached_property
from math import pi, radians, tan
from pathlib import Path
from typing import Annotated, Any, Literal

import pandas as pd
from pydantic import BeforeValidator, Field, ValidationInfo

from trackdyn.errors import InputError
from trackdyn.parameters.groove import Groove, build_groove, connector_length
from trackdyn.parameters.validation import Section, plain_count, plain_number, read_yaml, shown, validated

KINDS = ("printed", "derived", "assumed", "fitted")
YAML_12_FLOAT = re.compile(r"[-+]?\d+(\.\d*)?[eE]\d+")
ENTRY_KEYS = {"value", "unit", "kind", "source"}
RANGE_KEYS = {"low", "high"}  # what the part can be, for what is assumed or fitted
FROM_FILE = "from a file"  # there every entry states its unit, in Python none does
# what pydantic puts into a schema behind a validator of our own, and how JSON Schema says it
BOUNDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
LARGEST = 1e20  # of any value in its unit: squares and ratios of such values are still numbers


def _number(value: Any) -> float:
    """A number or what YAML takes for text, such as 2e11; NaN for anything else."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return float("nan")


def _unwrap(unit: str, kind: type):
    def unwrap(entry: Any, info: ValidationInfo) -> Any:
        if isinstance(entry, dict):
            value = _value(entry, unit)
        elif info.context is FROM_FILE:
            raise ValueError(
                f"= {shown(entry)} has no unit; write {{value: {shown(entry)}, unit: {unit}, kind: assumed, source: ...}}"
            )
        else:  # from Python, already in the right unit
            value = entry
        return {float: plain_number, int: plain_count}.get(kind, lambda name: name)(value)

    return BeforeValidator(unwrap)


def _value(entry: dict, unit: str) -> Any:
    """Value of an entry of the file, whose other keys are checked."""
    if missing := ENTRY_KEYS - entry.keys():
        raise ValueError(f"lacks {', '.join(sorted(missing))}; every parameter has value, unit, kind and source")
    if unknown := entry.keys() - ENTRY_KEYS - RANGE_KEYS:
        raise ValueError(
            f"has the unknown key {shown(next(iter(unknown)))}; known are value, unit, kind, low, high, source"
        )
    if RANGE_KEYS & entry.keys() and not _number(entry.get("low")) <= _number(entry.get("high")):
        raise ValueError("needs low and high as rising numbers, or neither")
    if str(entry["unit"]) != unit:
        raise ValueError(f"has the unit {shown(entry['unit'])}; it must be given in {unit!r}")
    if entry["kind"] not in KINDS:
        raise ValueError(f"has the kind {shown(entry['kind'])}; known are {', '.join(KINDS)}")
    if not isinstance(entry["source"], str) or not entry["source"].strip():
        raise ValueError("has no source; say in words where the number comes from")
    value = entry["value"]
    if isinstance(value, str) and YAML_12_FLOAT.fullmatch(value):  # PyYAML reads 2e11 as text
        value = float(value)
    if isinstance(value, bool) or (isinstance(value, str) and unit != "name"):
        raise ValueError(f"is {shown(value)}; a number in {unit} is needed")
    return value


class _Entry:
    """In the schema for editors a parameter is what stands in the file: value, unit, kind and source."""

    def __init__(self, unit: str):
        self.unit = unit

    def __get_pydantic_json_schema__(self, core_schema: Any, handler: Any) -> dict:
        word, number = {"type": "string", "pattern": r"\S"}, {"type": "number"}
        value = {BOUNDS.get(key, key): part for key, part in handler(core_schema).items()}
        entry = {"value": value, "unit": {"const": self.unit}, "kind": {"enum": list(KINDS)}, "source": word}
        together = {"low": ["high"], "high": ["low"]}
        return {
            "type": "object", "properties": entry | dict.fromkeys(sorted(RANGE_KEYS), number), "required": sorted(ENTRY_KEYS),
            "dependentRequired": together, "additionalProperties": False,
        }  # fmt: skip


def quantity(unit: str, kind: type = float, **bounds) -> Any:
    """Type of one parameter: its Python type, its unit and its bounds; a number is at most ``LARGEST``."""
    if kind in (float, int):
        bounds = {"le": LARGEST, "ge": -LARGEST} | bounds
    return Annotated[kind, _unwrap(unit, kind), Field(**bounds), _Entry(unit)]


Length = quantity("m", gt=0, le=1000)
Position = quantity("m")
Mass = quantity("kg", gt=0)
Inertia = quantity("kg m2", gt=0)
Tilt = quantity("deg", ge=-10, le=10)
Slope = quantity("deg", gt=-90, lt=90)
Friction = quantity("1", ge=0, le=2)


class ChainParameters(Section):
    pitches: quantity("1", int, ge=3, le=20_000)  # twice what the scaling was measured to
    link_length: Length
    link_thickness: Length
    link_mass: Mass
    link_inertia: Inertia
    link_inertia_along: Inertia
    link_inertia_across: Inertia
    connector_mass: Mass
    connector_inertia: Inertia
    connector_inertia_along: Inertia
    connector_inertia_across: Inertia
    connector_radius: Length


class ClosureParameters(Section):
    stiffness: quantity("N/m", gt=0)
    damping: quantity("N s/m", ge=0)


class Bushing(Section):
    stiffness: quantity("N m/rad", ge=0)
    damping: quantity("N m s/rad", ge=0)
    free_angle: quantity("rad", gt=-1.6, lt=1.6)
    radial_stiffness: quantity("N/m", gt=0)
    radial_damping: quantity("N s/m", ge=0)


class GrooveParameters(Section):
    seat_depth: Position
    slope_bottom: Slope
    slope_low: Slope
    slope_seat: Slope
    slope_tip: Slope
    r2: Length
    r3: Length
    r4: Length
    r5: Length


class Sprocket(Section):
    teeth: quantity("1", int, ge=5, le=127)  # a groove's number is kept in a byte
    transmission_ratio: quantity("1", gt=0)
    x: Position
    y: Position
    equal_pitch_radius: Length
    ring_radius: Length
    axial_offset: Position
    toe: Tilt
    camber: Tilt


class Wheel(Section):
    x: Position
    y: Position
    axial_offset: Position
    toe: Tilt
    camber: Tilt
    radius: Length
    inertia: Inertia
    bearing_drag: quantity("N m s/rad", ge=0)
    bearing_torque: quantity("N m", ge=0)


class Tension(Section):
    wheel: quantity("name", Literal["idler", "road_wheel"])
    pre_tension: quantity("N", ge=0)
    direction: quantity("deg")
    travel: Length
    mass: Mass
    stiffness: quantity("N/m", gt=0)
    damping: quantity("N s/m", ge=0)


class Guide(Section):
    clearance: quantity("m", ge=0)
    stiffness: quantity("N/m", gt=0)
    damping: quantity("N s/m", ge=0)


class Surface(Section):
    contact_length: Length
    axial_overhang: quantity("m", ge=0)
    youngs_modulus: quantity("Pa", gt=0)
    poisson_ratio: quantity("1", ge=0, lt=0.5)
    restitution: quantity("1", ge=1e-3, le=1)  # a loss factor of 1000: less is no contact law but a wall of glue
    friction_static: Friction
    friction_dynamic: Friction
    transition_velocity: quantity("m/s", gt=0)


class ImpactParameters(Section):
    speed_floor: quantity("m/s", gt=0)
    factor_limit: quantity("1", ge=1)


class Steel(Section):
    youngs_modulus: quantity("Pa", gt=0)
    poisson_ratio: quantity("1", ge=0, lt=0.5)


class SensorParameters(Section):
    pitch: quantity("1", int, ge=1)
    x: Position
    y: Position
    rate: quantity("Hz", int, gt=0, le=10**8)
    range: quantity("g", gt=0)


class Rig(Section):
    """The rig: sections of parameters in SI units (angles of the groove in degrees)."""

    gravity: quantity("m/s2", ge=0)
    chain: ChainParameters
    bushing: Bushing
    closure: ClosureParameters
    sprocket: Sprocket
    groove: GrooveParameters
    idler: Wheel
    road_wheel: Wheel
    tension: Tension
    steel: Steel
    tooth_contact: Surface
    ring_contact: Surface
    wheel_contact: Surface
    guide: Guide
    impact: ImpactParameters
    sensor: SensorParameters

    def model_post_init(self, context: Any) -> None:
        for name in ("tooth_contact", "ring_contact", "wheel_contact"):
            surface: Surface = getattr(self, name)
            if surface.friction_dynamic > surface.friction_static:
                raise InputError(
                    f"{name}.friction_dynamic = {surface.friction_dynamic} exceeds friction_static = "
                    f"{surface.friction_static}; the dynamic coefficient may at most equal the static one"
                )
        if self.sensor.pitch > self.chain.pitches:
            raise InputError(
                f"sensor.pitch = {self.sensor.pitch} is not a pitch of this chain; 1 to {self.chain.pitches} are"
            )

    @cached_property
    def pin_circle(self) -> float:
        """Radius of the circle of pins when links touch a ring of the equal-pitch radius, m."""
        middle = self.sprocket.equal_pitch_radius + self.chain.link_thickness / 2
        return (middle**2 + self.chain.link_length**2 / 4) ** 0.5

    @cached_property
    def connector_length(self) -> float:
        """Pin to pin length of the connector, derived from the equal-pitch radius, m."""
        return connector_length(self.sprocket.teeth, self.chain.link_length, self.pin_circle)

    @cached_property
    def single_pin_pitch(self) -> float:
        """Pin to pin length of a single-pin body, m: the pins stand where the links' lines meet at equal pitch."""
        middle = self.sprocket.equal_pitch_radius + self.chain.link_thickness / 2
        return 2 * middle * tan(pi / self.sprocket.teeth)

    @cached_property
    def groove_profile(self) -> Groove:
        """The ten arcs."""
        design = {name: radians(v) if name.startswith("slope") else v for name, v in self.groove.model_dump().items()}
        return build_groove(
            teeth=self.sprocket.teeth,
            connector_length=self.connector_length,
            connector_radius=self.chain.connector_radius,
            pin_circle=self.pin_circle,
            **design,
        )

    def loop_period(self, motor_rpm: float) -> float:
        """Time of one revolution of the loop, s."""
        return 60 * self.sprocket.transmission_ratio / motor_rpm * self.chain.pitches / self.sprocket.teeth

    def composite_modulus(self, surface: Surface) -> float:
        """E* of a surface against steel by Eq. (9), Pa."""
        steel = self.steel
        return 1 / (
            (1 - surface.poisson_ratio**2) / surface.youngs_modulus
            + (1 - steel.poisson_ratio**2) / steel.youngs_modulus
        )

    def changed(self, **changes: float) -> "Rig":
        """A rig with some values replaced, by dotted name written with two underscores.

        Examples
        --------
        ``rig.changed(sprocket__ring_radius=0.305, idler__bearing_drag=0.0)``
        """
        data = self.model_dump()
        for name, value in changes.items():
            section, _, field = name.partition("__")
            if section not in data or (field and not (isinstance(data[section], dict) and field in data[section])):
                raise InputError(f"{name.replace('__', '.')} is not a parameter of the rig")
            if field:
                data[section][field] = value
            else:
                data[section] = value
        return _validated(data, "rig")


def _validated(data: Any, name: str, context: str | None = None) -> Rig:
    rig = validated(Rig, data, name, "add it with value, unit, kind and source", context)
    try:
        rig.groove_profile  # noqa: B018 -- an impossible groove is refused here, not in mid-run
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return rig


def load_rig(path: Path | str) -> Rig:
    """Read and validate a rig.

    Raises
    ------
    InputError
        One sentence with file, field, value and what would be accepted.
    """
    return _validated(read_yaml(path), str(path), FROM_FILE)


def parameter_table(path: Path | str) -> pd.DataFrame:
    """Every parameter of a rig file: ``name, value, unit, kind, low, high, outside, source``, and the derived ones.

    ``outside`` says on which side a value leaves what the part can be.
    """
    rig = load_rig(path)
    rows = []
    for section, entries in read_yaml(path).items():
        if "value" in entries:
            rows.append({"name": section, **entries})
        else:
            rows += [{"name": f"{section}.{field}", **entry} for field, entry in entries.items()]
    derived = "from the equal-pitch radius, " + "13 [asin(a/2r) + asin(b/2r)] = pi"
    rows.append(dict(name="connector length", value=rig.connector_length, unit="m", kind="derived", source=derived))
    rows.append(dict(name="pin circle", value=rig.pin_circle, unit="m", kind="derived", source=derived))
    for row in rows:
        value, low, high = (_number(row.get(key)) for key in ("value", "low", "high"))
        row["outside"] = "below" if value < low else "above" if value > high else ""
    return pd.DataFrame(rows, columns=["name", "value", "unit", "kind", "low", "high", "outside", "source"])
