"""Parameters of the rig with value, unit, kind and source, read from YAML (`rig_file`) and validated."""

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from functools import cached_property, reduce
from math import pi, tan
from operator import getitem
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, PrivateAttr

from trackdyn.inputs import quantities
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.quantities import NAME, FieldValue, Quantity, entries_of, fields_of, outside_range
from trackdyn.inputs.validation import FrozenDict, Section, shown, typed, validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig import sections
from trackdyn.rig.arcs import ToothProfile
from trackdyn.rig.groove import Groove, build_groove, connector_length, equal_pitch_radii
from trackdyn.rig.rig_file import DEFAULT, DRAG_FIELDS, TRIED, groove_origin, read_rig, rig_path, shipped_rigs
from trackdyn.rig.sections import SensorParameters, Surface, TestedStep, Wheel

if TYPE_CHECKING:
    import pandas as pd

# relative differences of a chain from the one of its groove: of the pitch (worn out at 3 %), of the connectors' arcs
WORN, OTHER_ARC = 0.035, 0.01
RING_OFF = 0.05  # relative difference of a ring from the one at which links and grooves have one pitch
CHANGED = " changed"  # suffix of the name of a rig with other values than its file


class Rig(Section):
    """Sections of parameters in SI units (angles of the groove in degrees), and steps that were tried on the rig.

    Wheels other than the sprocket are wheels 1, 2, ... of a model in the order of ``wheels``. The first of ``sensors``
    is shown and compared by default. ``load`` is the default of a scene (`trackdyn.rig.layout.braked_wheel`).
    """

    gravity: Annotated[float, Quantity("m/s2", ge=0)]
    chain: sections.ChainParameters
    bushing: sections.Bushing
    closure: sections.ClosureParameters
    sprocket: sections.Sprocket
    groove: sections.GrooveParameters | None = None
    profile: ToothProfile | None = None
    wheels: Annotated[dict[str, Wheel], AfterValidator(FrozenDict)] = Field(default_factory=FrozenDict)
    drag: Annotated[sections.Drag, Quantity("name")] = "rolling"
    load: sections.Pull = 0.0
    tension: sections.Tension
    steel: sections.Steel
    tooth_contact: Surface
    ring_contact: Surface
    wheel_contact: Surface
    surfaces: Annotated[dict[str, Surface], AfterValidator(FrozenDict)] = Field(default_factory=FrozenDict)
    guide: sections.Guide
    impact: sections.ImpactParameters
    sensors: Annotated[dict[str, SensorParameters], AfterValidator(FrozenDict)] = Field(default_factory=FrozenDict)
    tried: Annotated[tuple[TestedStep, ...], Field(strict=False)] = ()
    _name: str = PrivateAttr("")

    @property
    def name(self) -> str:
        """Name of the rig's file, followed by ``changed`` if values were changed; empty without a file."""
        return self._name

    def called(self, name: str) -> "Rig":
        """Return the rig under another name."""
        other = self.model_copy()
        other._name = name
        return other

    @property
    def summary(self) -> str:
        """Name, chain, sprocket and wheels in one line."""
        kind, wheels = self.chain.kind.replace("_", "-"), ", ".join(self.wheels)
        named = f"{self.name}: " if self.name else ""
        return f"{named}{self.chain.pitches} pitches ({kind}), {self.sprocket.teeth} teeth, wheels {wheels}"

    def __repr__(self) -> str:
        return f"<Rig{' ' if self.name else ': '}{self.summary}>"

    __str__ = __repr__

    def model_dump(self, **options: Any) -> dict[str, Any]:
        """Return the values as plain data, without those that are defaults; ``options`` are pydantic's."""
        return super().model_dump(**{"exclude_defaults": True} | options)

    def model_post_init(self, context: Any) -> None:
        """Refuse (`InputError`) values that do not fit each other."""
        for fault in self._faults():
            raise InputError(fault)

    def _faults(self) -> Iterator[str]:
        """Yield errors, first those of wheels, surfaces and sensors by their names."""
        yield from self._member_faults()
        for name, surface in self.contact_surfaces.items():
            static, dynamic = surface.friction_static, surface.friction_dynamic
            if dynamic > static:
                remedy = "the dynamic coefficient may at most equal the static one"
                yield f"{name}.friction_dynamic = {dynamic} exceeds friction_static = {static}; {remedy}"
            if surface.friction_law == "dahl" and surface is self.tooth_contact:
                reason = "Dahl's law is of a link on a wheel, whose surface gives way"
                yield f"{name}.friction_law = dahl: {reason}; a tooth has regularised"
            elif surface.friction_law == "dahl" and surface.shear_stiffness is None:
                needed = "the force per way (N/m) at which the surface gives way under a link"
                field = f"{name}.shear_stiffness is missing, which {name}.friction_law = dahl needs"
                yield f"{field}: {needed}; state it, or use regularised"
        if (self.groove is None) == (self.profile is None):
            yield "groove is missing; a tooth has groove or profile, and one of them only"
        ring, equal = self.ring_radius, self.sprocket.equal_pitch_radius
        if ring is not None and abs(ring - equal) > RING_OFF * equal:
            off = f"is more than {RING_OFF:.0%} off sprocket.equal_pitch_radius = {equal:.4g} m"
            remedy = "state both, or chain.pitch in place of both, or sprocket.ring = none"
            yield f"sprocket.ring_radius = {ring:g} m {off}; links and grooves would not have one pitch; {remedy}"
        tension = self.tension
        if not isinstance(tension.wheel, str) or tension.wheel not in self.wheels:
            names = " or ".join(map(repr, self.wheels))
            yield f"tension.wheel = {shown(tension.wheel)} is not a wheel of this rig; choose {names}"
        elif self.wheels[tension.wheel].suspension is not None:
            own = "has an arm or a slider of its own, which tension.kept = sprung gives to the tensioner"
            yield f"tension.wheel = {tension.wheel!r} {own}; choose a fixed wheel"

    def _member_faults(self) -> Iterator[str]:
        """Yield errors of names that are missing or mean something else, then of wheels and sensors."""
        taken = {*type(self).model_fields}
        for group, example in (("wheels", "idler"), ("surfaces", ""), ("sensors", "sensor")):
            if example and not getattr(self, group):
                yield f"{group} is missing; a rig needs at least one, such as {example}"
            for name in getattr(self, group):
                if name in taken or not NAME.fullmatch(name):
                    remedy = "use lower-case letters, digits and _, and not the name of a section, a wheel or a surface"
                    yield f"{group}.{shown(name)} is not a valid name: {remedy}"
            taken.update(getattr(self, group))
        for name, wheel in self.wheels.items():
            if wheel.surface not in self.contact_surfaces:
                choice = ", ".join(self.contact_surfaces)
                yield f"{name}.surface = {shown(wheel.surface)} is not a surface of this rig; choose {choice}"
            if wheel.arm is not None and wheel.slider is not None:
                yield f"{name}.slider is not allowed together with {name}.arm; a wheel has one of them or is fixed"
            if wheel.arm is not None and (wheel.arm.x, wheel.arm.y) == (wheel.x, wheel.y):
                yield f"{name}.arm.x = {wheel.arm.x:g} m, and its y, are the wheel's own position; move the pivot"
        for name, sensor in self.sensors.items():
            if sensor.pitch > self.chain.pitches:
                yield f"{name}.pitch = {sensor.pitch} is not a pitch of this chain; 1 to {self.chain.pitches} are"
            if sensor.rate != self.rate:
                others = f"another sensor has {self.rate} Hz; all sensors of a rig have one rate"
                yield f"{name}.rate = {sensor.rate} Hz: {others}"

    @property
    def first_sensor(self) -> SensorParameters:
        """Sensor that is shown and compared by default."""
        return next(iter(self.sensors.values()))

    @property
    def rate(self) -> int:
        """Samples a second of every sensor, Hz."""
        return self.first_sensor.rate

    @property
    def g(self) -> float:
        """Unit of acceleration of the sensors, 1 g in m/s2: gravity, or that of the earth if the rig has none."""
        return self.gravity or 9.81

    @property
    def contact_surfaces(self) -> dict[str, Surface]:
        """Contact surfaces by name."""
        names = ("wheel_contact", "ring_contact", "tooth_contact")
        return {name: getattr(self, name) for name in names} | self.surfaces

    @property
    def ring_radius(self) -> float | None:
        """Radius of the rig's ring (m), None without a ring."""
        return self.sprocket.ring_radius if self.sprocket.ring == "present" else None

    def tried_step(self, motor_rpm: float) -> TestedStep | None:
        """Return the step tried at the next motor speed at or above ``motor_rpm`` (rev/min), or at the fastest one."""
        steps = sorted(self.tried, key=lambda step: step.rpm)
        return next((step for step in steps if step.rpm >= motor_rpm), steps[-1] if steps else None)

    @property
    def without_effect(self) -> list[str]:
        """Names of the values, except zeros, that the laws of this rig do not read."""
        unread = [field for law, fields in DRAG_FIELDS.items() if law != self.drag for field in fields]
        ignored = {f"{name}.{field}" for name in self.wheels for field in unread}
        ignored.add("bushing.loss_factor" if self.bushing.law == "viscous" else "bushing.damping")
        for name, surface in self.contact_surfaces.items():
            dahl = surface.friction_law == "dahl"
            of_other_law = ["transition_velocity", "friction_dynamic"] if dahl else ["shear_stiffness"]
            ignored |= {f"{name}.{field}" for field in of_other_law}
        if self.tension.kept != "sprung":
            ignored |= {"tension.mass", "tension.stiffness", "tension.damping"}
        return [name for name, field in self.fields.items() if name in ignored and field.value]

    def link_ahead(self, connector: int) -> int:
        """Return the pitch, from 1, of the link that runs ahead of a connector."""
        return connector % self.chain.pitches + 1

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
        """Pin-to-pin length of a single-pin body, m: its pins are where the links' lines meet at equal pitch."""
        middle = self.sprocket.equal_pitch_radius + self.chain.link_thickness / 2
        return 2 * middle * tan(pi / self.sprocket.teeth)

    @cached_property
    def pitch(self) -> float:
        """Length of a pitch of the chain, m."""
        if self.chain.kind == "single_pin":
            return self.single_pin_pitch
        return self.chain.link_length + self.connector_length

    @cached_property
    def equal_pitch_radii(self) -> dict[str, float]:
        """Ring radii of equal pitch (m) by four definitions (`groove.equal_pitch_radii`)."""
        link = self.single_pin_pitch if self.chain.kind == "single_pin" else self.chain.link_length
        return FrozenDict(equal_pitch_radii(self.sprocket.teeth, link, self.pitch - link, self.chain.link_thickness))

    @cached_property
    def groove_profile(self) -> Groove:
        """Groove of the ten arcs of the design, or of a profile. Raises `InputError`: the arcs make no groove."""
        if self.groove is None:
            assert self.profile is not None, "a tooth has groove or profile"
            size, equal = self.profile.size, self.sprocket.equal_pitch_radius
            if not 0.4 < size / equal < 2.5:
                unit = ", not in mm" if 300 < size / equal < 3000 else ""
                where = f"{size:.4g} m from the sprocket's centre, where sprocket.equal_pitch_radius is {equal:.4g} m"
                raise InputError(f"profile lies {where}; its lengths must be in m{unit}")
            return self.profile.groove(self.sprocket.teeth, self.chain.connector_radius)
        bodies = self.connector_length, self.chain.connector_radius, self.pin_circle
        return build_groove(self.groove, self.sprocket.teeth, *bodies)

    def composite_modulus(self, surface: Surface) -> float:
        """Return E* of a surface against steel by Eq. (9), Pa."""
        return 1 / sum((1 - solid.poisson_ratio**2) / solid.youngs_modulus for solid in (surface, self.steel))

    @cached_property
    def fields(self) -> dict[str, FieldValue]:
        """Fields by their dotted names; a wheel, a surface or a sensor is a section by its name."""
        return FrozenDict({name: field for name, field in fields_of(self) if field.unit is not None})

    @classmethod
    def may_have(cls, name: str) -> bool:
        """Return whether some rig has a field of this dotted name."""
        first, _, rest = name.partition(".")
        if first not in cls.model_fields:
            name = f"*.{rest}" if NAME.fullmatch(first) else ""
        return name in quantities.possible_fields(cls)

    def _field(self, name: str, fields: Mapping[str, FieldValue]) -> FieldValue:
        """Return the field of a name; `InputError` with similar names if there is none."""
        if name in fields:
            return fields[name]
        close = get_close_matches(name, self.fields, 2)
        hint = f"did you mean {' or '.join(close)}?" if close else "a name such as bushing.stiffness is accepted"
        raise InputError(f"{shown(name)} is not a parameter of the rig; {hint}")

    @typed
    def value(self, name: str) -> Any:
        """Return the value of a field by its dotted name, such as ``road_1.arm.stiffness``, or raise `InputError`."""
        return self._field(name, self.fields).value

    def changed(self, **changes: Any) -> "Rig":
        """Return a rig with some values replaced, in SI units by dotted name; None removes an optional section.

        Two underscores stand for a dot: ``rig.changed(sprocket__ring_radius=0.305, idler__bearing_drag=0.0)``,
        ``rig.changed(**{"road_1.arm": None})``. Raises `InputError`: a field is unknown, or its value is refused.
        """
        data, fields = self.model_dump() | {TRIED: ()}, dict(fields_of(self))  # the steps were tried on another rig
        for name, value in changes.items():
            *sections, field = self._field(name.replace("__", "."), fields).keys
            try:
                reduce(getitem, sections, data)[field] = value
            except (KeyError, TypeError):
                raise InputError(f"{name} is in a section that another change replaces; set it there") from None
        return _validated(data, "rig").called(self.name and f"{self.name.removesuffix(CHANGED)}{CHANGED}")

    def sampled(self, rate: int) -> "Rig":
        """Return a rig whose sensors take ``rate`` samples per second, Hz; `InputError` as in `changed`."""
        return self.changed(**{f"{name}.rate": rate for name in self.sensors})


def _validated(data: Any, name: str, context: str | None = None, path: Path | str | None = None) -> Rig:
    rig = validated(Rig, data, name, "add it with value, unit, kind and source", context)
    try:
        rig.groove_profile  # noqa: B018 -- an impossible groove is refused here, not in mid-run
    except InputError as error:
        foreign = "" if path is None else foreign_groove(rig, path)
        raise InputError(f"{name}: {foreign + '; as it is, ' if foreign else ''}{error}") from None
    return rig


@typed
def load_rig(path: Path | str = DEFAULT) -> Rig:
    """Read a rig from a YAML file, or an included one by its name; `InputError` names file, field, value and remedy."""
    data = read_rig(path)
    if (tried := read_yaml(rig_path(path)).get(TRIED)) is not None:
        data[TRIED] = tried
    return _validated(data, str(path), quantities.FROM_FILE, path).called(Path(path).stem)


def outside_ranges(path: Path | str) -> list[str]:
    """Return a sentence for each value of a rig file, its own or inherited, that lies outside its range."""
    sentences = []
    for name, entry in entries_of(read_rig(path)).items():
        if side := outside_range(entry):
            value = f"{entry['value']:.6g} {entry['unit']}".removesuffix(" 1")
            sentences.append(f"{name} = {value} lies {side} its range, {entry['low']:g} to {entry['high']:g}")
    return sentences


def foreign_groove(rig: Rig, path: Path | str | None = None) -> str:
    """Return a remark on a tooth made for another chain, the one that ``path`` inherits or an included one; else ""."""
    if path is None:
        rigs = {name: load_rig(name) for name in shipped_rigs()}
        same = {name: r for name, r in rigs.items() if (r.groove, r.profile) == (rig.groove, rig.profile)}
    else:
        origin = groove_origin(path)
        same = {} if origin is None else {origin.stem: load_rig(origin)}
    remarks = []
    for name, other in same.items():
        numbers = [(r.sprocket.teeth, r.pitch, r.chain.connector_radius) for r in (other, rig)]
        shares = zip(*numbers, (0.0, WORN, OTHER_ARC), strict=True)
        if all(abs(own / other_value - 1) <= share for other_value, own, share in shares):
            return ""
        theirs, ours = ("{} teeth, pitch {:.4g} m, arcs of {:.3g} m".format(*row) for row in numbers)
        remarks.append(f"the groove is that of {name} ({theirs}), this rig has {ours}: state groove or profile")
    return next(iter(remarks), "")


def parameter_table(path: Path | str) -> "pd.DataFrame":
    """Return a table of the parameters of a rig file and derived ones; ``outside`` is the side beyond its range."""
    import pandas as pd  # half a second that a run does without

    rig = load_rig(path)
    derived = f"from the equal-pitch radius, {rig.sprocket.teeth} [asin(a/2r) + asin(b/2r)] = pi"
    entries = entries_of(read_rig(path))
    for name, value in {"connector length": rig.connector_length, "pin circle": rig.pin_circle}.items():
        entries[name] = {"value": value, "unit": "m", "kind": "derived", "source": derived}
    rows = [{"name": name, "outside": outside_range(entry), **entry} for name, entry in entries.items()]
    return pd.DataFrame(rows, columns=["name", "value", "unit", "kind", "low", "high", "outside", "source"])
