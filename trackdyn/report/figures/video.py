"""A film of a stretch of a run: the whole loop coloured by tension, the sprocket, and the tension along the chain."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from tqdm import tqdm

from trackdyn.errors import InputError
from trackdyn.files import replacing
from trackdyn.report.drawing import EDGE, RUBBER, STEEL, STEEL_EDGE, placed, ring_words, stadium
from trackdyn.report.page.show import geometry
from trackdyn.report.style import BLACK, styled
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.replay import SIDES, Stretch

WIDTH, HEIGHT, DPI = 12.8, 7.2, 100  # inch and dots an inch
COLOURS = ("#0072b2", "#b0468f", "#00835f", "#8a5a00")  # of left arc, right arc, ring, other wheels
END = 6  # points of half an end of a connector
LEAST_RATE, MOST_RATE = 1.0, 60.0  # pictures a second


def find_ffmpeg() -> str:
    """The program that makes the film: ffmpeg of the system, or that of imageio-ffmpeg.

    Raises
    ------
    InputError
        There is none.
    """
    if FFMpegWriter.isAvailable():
        return FFMpegWriter.bin_path()
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise InputError(
            "no ffmpeg is found, which makes the film: pip install 'trackdyn[video]' or ffmpeg of your system would do"
        ) from None


def refuse_no_film(recording: Recording, pace: float) -> None:
    """Refuse what cannot become a film before anything is computed for it.

    Raises
    ------
    InputError
        There is no ffmpeg, the pace is out of range, or the run is one of a belt, which has no bodies.
    """
    find_ffmpeg()
    if recording.meta["scene"]["chain"] == "belt":
        raise InputError(
            "a belt has no bodies that a film could show (chain = 'belt'); a run with chain='double_pin' would do"
        )
    if not 1e-4 <= pace <= 100:
        raise InputError(
            f"pace = {pace:g} is not accepted: seconds of the run in a second of the film, at least "
            "0.0001 and at most 100, would do"
        )


class Film:
    """The figure of a film, redrawn for every picture.

    Parameters
    ----------
    recording : Recording
    stretch : Stretch
        Of it.
    """

    def __init__(self, recording: Recording, stretch: Stretch):
        self.stretch, self.shape = stretch, geometry(recording, stretch)
        self.ring = recording.meta["scene"]["ring_radius"]
        # axes are placed by hand; the style's layout engine would move them
        self.figure = Figure(figsize=(WIDTH, HEIGHT), layout="constrained")
        self.figure.set_layout_engine("none")
        FigureCanvasAgg(self.figure)
        scene = recording.meta["scene"]
        self.figure.text(0.01, 0.965, f"{scene['motor_rpm']:g} rpm, {ring_words(scene['ring_radius'])}", fontsize=11)
        self.clock = self.figure.text(0.3, 0.965, "", fontsize=11)
        low, high = np.percentile(stretch.tension, [1, 99])
        self.colours = ScalarMappable(Normalize(low / 1e3, max(high, low + 1.0) / 1e3), "RdYlBu_r")
        points = stretch.bodies[:, :, :2].reshape(-1, 2)
        low, high = points.min(axis=0), points.max(axis=0)
        margin = self.shape["margin"]
        self.views = [self._view((0.005, 0.29, 0.6, 0.66), (low + high) / 2, (high - low) / 2 + margin, "loop")]
        if self.shape["teeth"]:
            reach = 1.42 * self.shape["addendum"] * np.ones(2)
            self.views.append(
                self._view((0.61, 0.29, 0.385, 0.66), np.array(self.shape["sprocket"]), reach, "sprocket")
            )
        self._tension()
        self._legend()

    def _view(self, box, middle, half, name) -> dict:
        ax = self.figure.add_axes(box)
        ax.set_axis_off()
        wide = box[2] * WIDTH / (box[3] * HEIGHT)
        half = np.maximum(half, [half[1] * wide, half[0] / wide])
        ax.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
        bar, shape = self.shape["bars"][name], self.shape
        edge = {"edgecolor": BLACK, "linewidth": 0.6}
        discs = [
            [
                ax.add_patch(Circle((x, y), part * radius, facecolor=face, **edge))
                for part, face in ((1, RUBBER), (0.9, STEEL))
            ]
            for x, y, radius in self.stretch.wheels[0][1:]
        ]
        if self.ring is not None and len(self.stretch.wheels[0]):
            ax.add_patch(Circle(shape["sprocket"], self.ring, facecolor=RUBBER, **edge))
        teeth = ax.add_collection(PolyCollection([], facecolor=STEEL, edgecolor=STEEL_EDGE, linewidth=0.8, zorder=2))
        clear = {"edgecolor": EDGE, "linewidth": 0.5, "alpha": 1.0 if name == "loop" else 0.75}
        connectors = ax.add_collection(PolyCollection([], zorder=3, **clear))
        links = ax.add_collection(PolyCollection([], zorder=4, **clear))
        arrows = ax.add_collection(LineCollection([], linewidth=1.8, zorder=6))
        feet = ax.scatter([], [], s=14, zorder=7, edgecolor="white", linewidth=0.5)
        x, y = middle - 0.95 * half
        if shape["force_bar"]:
            ax.plot([x, x + bar], [y, y], color=BLACK, linestyle="-", linewidth=1.5, marker="|", markersize=6)
            ax.text(x + bar / 2, y + 0.02 * half[1], f"{shape['force_bar']:g} N", ha="center", va="bottom", fontsize=8)
        scale = bar / shape["force_bar"] if shape["force_bar"] else 0.0  # of the arrows, m/N
        return {
            "discs": discs, "teeth": teeth, "connectors": connectors, "links": links, "arrows": arrows, "feet": feet,
            "scale": scale,
        }  # fmt: skip

    def _tension(self) -> None:
        ax = self.figure.add_axes((0.06, 0.075, 0.86, 0.19))
        pitches = self.stretch.loop.scene.rig.chain.pitches
        for k, (name, (begin, end)) in enumerate(zip(self.stretch.names, self.stretch.spans, strict=True)):
            for back in (0, pitches):
                if end > back and begin < pitches + back:
                    ax.axvspan(max(begin - back, 0), min(end - back, pitches), color="0.88", zorder=0)
                    middle = (max(begin - back, 0) + min(end - back, pitches)) / 2
                    place = {"xycoords": ("data", "axes fraction"), "ha": "center", "fontsize": 8}
                    ax.annotate(name, (middle, 0.04 + 0.13 * (k % 3)), **place)
        self.line = ax.plot([], [], color=BLACK, linestyle="-", linewidth=1.0, marker=".", markersize=3)[0]
        ax.set(xlim=(0, pitches), ylim=(0, 1.05e-3 * self.stretch.tension.max()))
        ax.set_xlabel("place around the loop (pitches)", fontsize=8)
        ax.set_ylabel("force in the joints (kN)", fontsize=8)
        ax.tick_params(labelsize=7)
        bar = self.figure.colorbar(self.colours, cax=self.figure.add_axes((0.935, 0.075, 0.012, 0.19)))
        bar.ax.tick_params(labelsize=7)

    def _legend(self) -> None:
        seen = {int(side) for of in self.stretch.contacts for side in of[:, 0]}
        names = [*SIDES, "other wheels"]
        for k, i in enumerate(sorted({min(side, 3) for side in seen})):
            self.figure.text(0.62 + 0.09 * k, 0.965, f"\N{BLACK CIRCLE} {names[i]}", color=COLOURS[i], fontsize=9)

    def draw(self, index: int) -> None:
        """Draw a picture of the stretch."""
        stretch, shape = self.stretch, self.shape
        bodies, contacts = stretch.bodies[index], stretch.contacts[index]
        links = [self._link(bodies, *of) for of in shape["links"]]
        connectors = [self._connector(bodies, *of) for of in shape["arcs"]]
        tints = self.colours.to_rgba(stretch.tension[index] / 1e3)
        of_links, of_connectors = [of[0] for of in shape["links"]], [of[0] for of in shape["arcs"]]
        feet, forces = contacts[:, 1:3], contacts[:, 3:5]
        looks = [COLOURS[min(int(side), 3)] for side in contacts[:, 0]]
        for view in self.views:
            for discs, (x, y, _) in zip(view["discs"], stretch.wheels[index][1:], strict=True):
                for disc in discs:
                    disc.center = x, y
            view["teeth"].set_verts([self._teeth(stretch.turned[index])] if shape["teeth"] else [])
            for name, outlines, of in (("links", links, of_links), ("connectors", connectors, of_connectors)):
                view[name].set_verts(outlines)
                view[name].set_facecolor(tints[of])
            view["arrows"].set_segments(np.stack([feet, feet + forces * view["scale"]], axis=1))
            view["arrows"].set_color(looks)
            view["feet"].set_offsets(feet)
            view["feet"].set_facecolor(looks)
        order = np.argsort(stretch.place[index])
        self.line.set_data(stretch.place[index][order], stretch.tension[index][order] / 1e3)
        self.clock.set_text(f"{stretch.time[index]:.3f} s")

    def _link(self, bodies, body, start, end) -> np.ndarray:
        half = self.shape["thickness"] / 2
        return placed([[start, -half], [end, -half], [end, half], [start, half]], bodies[body, :2], bodies[body, 2])

    def _connector(self, bodies, left, at_left, right, at_right) -> np.ndarray:
        ends = [placed([[at, 0.0]], bodies[b, :2], bodies[b, 2])[0] for b, at in ((left, at_left), (right, at_right))]
        along = ends[1] - ends[0]
        outline = stadium(float(np.hypot(*along)), self.shape["arc"], 2 * END)
        return placed(outline, ends[0], float(np.arctan2(along[1], along[0])))

    def _teeth(self, angle: float) -> np.ndarray:
        # a groove runs clockwise from tip to tip, so the grooves follow each other in falling order
        outline, teeth = np.array(self.shape["outline"]), self.shape["teeth"]
        turns = [angle + (2 * k - 1) * np.pi / teeth - np.pi / 2 for k in range(teeth, 0, -1)]
        return np.vstack([placed(outline, self.shape["sprocket"], turn) for turn in turns])


@styled
def write_video(
    recording: Recording, stretch: Stretch, path: Path | str, pace: float = 0.25, progress: bool = False
) -> int:
    """Write a stretch of a run as a film (MP4, H.264); returns how many pictures.

    Parameters
    ----------
    recording, stretch
        The run, and what was looked at again.
    path : path
        File to write, whole or not at all.
    pace : float
        Seconds of the run that a second of the film shows.
    progress : bool
        Show a progress bar.

    Raises
    ------
    InputError
        As `refuse_no_film`, or the file cannot be written.
    """
    refuse_no_film(recording, pace)
    film, rate = Film(recording, stretch), pace / stretch.interval
    every = max(1, int(np.ceil(rate / MOST_RATE)))
    indices = range(0, len(stretch.time), every)
    with matplotlib.rc_context({"animation.ffmpeg_path": find_ffmpeg()}):
        writer = FFMpegWriter(fps=max(rate / every, LEAST_RATE), codec="libx264", extra_args=["-pix_fmt", "yuv420p"])
        with replacing(path) as part, writer.saving(film.figure, part, dpi=DPI):
            for index in tqdm(indices, disable=not progress, desc="film", unit="picture"):
                film.draw(index)
                writer.grab_frame()
    return len(indices)


@styled
def still(recording: Recording, stretch: Stretch, index: int = 0) -> Figure:
    """One picture of the film."""
    film = Film(recording, stretch)
    film.draw(index)
    return film.figure
