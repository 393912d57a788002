"""Run until the answer is known: the end of the transient is found, and the record grows until the errors are small."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil

from trackdyn.errors import InputError
from trackdyn.loop import Loop
from trackdyn.measure.whole_loop import RELATIVE, SHARES, Estimate, passage, series
from trackdyn.recording import Recording
from trackdyn.scene import Scene
from trackdyn.starts import Starts
from trackdyn.writer import Writer

# Passages that must be left after the transient: fewer batches than three say little about their own scatter.
LEAST = 9
# of a record from one judgement to the next
GROWTH = 1.1


@dataclass(frozen=True)
class Answer:
    """What is known at the end of a run.

    Attributes
    ----------
    measures : dict of str to Estimate
        All measures with their errors (`measure.whole_loop.series`).
    reached : dict of str to bool
        For each measure that was asked for: is its 95 % interval within the tolerance?
    transient : float
        Time at constant speed that was left out, s.
    recording : Recording
        All that was recorded, with every link.
    """

    measures: dict[str, Estimate]
    reached: dict[str, bool]
    transient: float
    recording: Recording

    @property
    def known(self) -> bool:
        """Every tolerance was reached."""
        return all(self.reached.values())


def run_until(
    scene: Scene,
    tolerances: Mapping[str, float],
    longest: float = 60.0,
    tick: Callable[[float], object] = lambda seconds: None,
    starts: Starts | None = None,
) -> Answer:
    """Start the sprocket and record every link until all tolerances are reached, or for ``longest`` seconds.

    After each chunk every measure's transient is cut off by the marginal standard error rule
    (`measure.whole_loop.Series.transient`); the longest one counts for all. The run ends when half of the 95 % interval of
    each asked measure, by batch means, is within its tolerance and at least nine passages are left.

    Parameters
    ----------
    scene : Scene
        Duration and lead-in are not used.
    tolerances : mapping of str to float
        Measure and tolerance: relative for ``rms, sd, line, left_peak``; a share of a sprocket turn (0.01 is one point)
        for ``left_share, right_share, ring_share``.
    longest : float
        s at constant speed.
    tick : function
        Called with the seconds that every chunk adds.
    starts : Starts or None
        Loops that were settled before, for a series of scenes.

    Raises
    ------
    InputError
        A measure or tolerance is not accepted, or ``longest`` holds too few passages.
    DivergenceError
        As in `simulate`.
    """
    _refuse(scene, tolerances, longest)
    rate = scene.rig.sensor.rate
    scene = scene.with_(
        duration=ceil(longest * rate) / rate, lead_in=0.0, pitches=(), frame_interval=0.0, spells=True, every_link=True
    )
    loop = Loop(scene, starts)
    loop.advance(scene.ramp, tick)
    writer = Writer(loop, scene.duration, (), 0.0, True, True)
    judged = (LEAST + 1) / (scene.loop_frequency * scene.rig.chain.pitches) * rate
    while True:
        tick(writer.chunk())
        if writer.finished or writer.done >= judged:
            answer = _judge(writer.recording(), tolerances)
            if writer.finished or answer.known:
                return answer
            judged = GROWTH * writer.done


def _judge(recording: Recording, tolerances: Mapping[str, float]) -> Answer:
    found = series(recording)
    first = max((found[name].transient() for name in tolerances if name in found), default=0)
    known = {name: measure.since(first).estimate() for name, measure in found.items()}
    reached = {}
    for name, tolerance in tolerances.items():
        measure = known.get(name)
        enough = measure is not None and len(found[name].since(first).values) >= LEAST
        scale = 100.0 if name in SHARES else abs(measure.value) if enough else 0.0
        reached[name] = bool(enough and measure.half_width <= tolerance * scale)
    return Answer(known, reached, first * passage(recording), recording)


def refuse_undriven(scene: Scene) -> None:
    """Refuse what has no passages of pitches.

    Raises
    ------
    InputError
        The scene has no chain that is driven on its wheels.
    """
    if scene.chain == "belt" or scene.loop == "free" or scene.motor_rpm == 0:
        raise InputError("scene: only a chain that is driven on its wheels comes to an answer; chain='double_pin' would do")


def _refuse(scene: Scene, tolerances: Mapping[str, float], longest: float) -> None:
    if not tolerances:
        raise InputError("tolerances is empty; name a measure and a tolerance, such as rms and 0.01")
    for name, value in tolerances.items():
        if name not in RELATIVE + SHARES:
            raise InputError(f"measure = {name!r} is not accepted: {', '.join(RELATIVE + SHARES)} would do")
        if not 0.0 < value < 1.0:
            raise InputError(f"tolerance = {value!r} of {name} is not accepted: a number between 0 and 1, such as 0.01, would do")
    refuse_undriven(scene)
    least = (LEAST + 1) / (scene.loop_frequency * scene.rig.chain.pitches)
    if not least < longest <= 36000.0:
        raise InputError(f"longest = {longest!r} s is not accepted: {least:.3g} s (ten passages of a pitch) to ten hours would do")
