"""Animation of the loop as a small GIF, with the normal forces on every pitch."""

from trackdyn.sweeps.snakemake_job import run_job

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from trackdyn.inputs.files import replacing
from trackdyn.model.arrays import SIDE_WORDS, SIDES
from trackdyn.plots import drawing
from trackdyn.plots.style import styled
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn_replication.report import marks
from trackdyn_replication.report.figures.meshing import LOOKS, contacts_at, draw_force

WIDTH, HEIGHT, DPI = 6.0, 2.9, 90  # inch and dots an inch: letters are read at two thirds of a web page
COLOURS = 32  # common to all pictures of the GIF: they change little from one to the next, and pack well
INTERVAL = 0.04  # between pictures, s of the run
PACE = 2.0  # the GIF is slower than the run by this factor
BAR, BAR_IN_LOOP = 0.12, 0.2  # scale bar of the forces in pictures of the sprocket and of the whole loop, m


def draw_moment(ax: Axes, recording: Recording, index: int, near: bool) -> None:
    """Draw wheels, chain and forces at one recorded configuration: ``near`` the sprocket, or the whole loop."""
    rig, frame = recording.scene.rig, recording.frame[index]
    drawing.draw_loop(ax, rig, frame, recording.layout.tensioner_shift_m, recording.scene.ring_radius)
    # a configuration and a sample are both taken at the end of their interval
    sample = int(np.clip(round(recording.frame_time[index] * recording.rate) - 1, 0, len(recording.time) - 1))
    bar, chain = BAR if near else BAR_IN_LOOP, drawing.chain_points(rig, frame)
    for column, pitch in enumerate(recording.pitches):
        link = 2 * (int(pitch) - 1)
        at_pitch = (array[sample, column] for array in (recording.force, recording.area, recording.groove))
        for side, force, point, normal in contacts_at(rig, chain, link + 1, link, *at_pitch):
            end = point + drawing.force_arrow(force, bar) * normal
            draw_force(ax, side, point, end, linewidth=1.5, head=7.5, halo=3.3, mark=3.9)
    ax.set_aspect("equal")
    ax.set_axis_off()
    pins = drawing.chain_points(rig, recording.frame[0])[0]
    low, high = pins.min(axis=0) - 0.2, pins.max(axis=0) + 0.2  # room for the arrows
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    if near:
        middle, half = drawing.sprocket_centre(rig), 1.42 * rig.groove_profile.addendum * np.ones(2)
    # fill the axes at equal scales
    box, paper = ax.get_position(original=True), ax.figure.get_size_inches()
    ratio = box.width * paper[0] / (box.height * paper[1])
    drawing.view(ax, middle, np.maximum(half, [half[1] * ratio, half[0] / ratio]))
    drawing.draw_force_bar(ax, bar)


@styled
def write_animation(recording: Recording, path: Path | str) -> None:
    """Write a turn of the sprocket as a GIF, next to the whole loop; after it each body is where another one was."""
    scene = recording.scene
    stride = max(1, round(INTERVAL / scene.frame_interval))
    step = stride * scene.frame_interval
    indices = [i * stride for i in range(round(recording.periods.turn / step)) if i * stride < len(recording.frame)]
    figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DPI, layout="none")  # axes are placed by hand
    FigureCanvasAgg(figure)
    figure.suptitle(f"{scene.motor_rpm:g} rpm, {drawing.ring_words(scene.ring_radius)}", x=0.02, ha="left", fontsize=9)
    handles = [
        marks.handle(words, **LOOKS[side] | {"linestyle": "-"}, markersize=4)
        for i, (side, words) in enumerate(zip(SIDES, SIDE_WORDS, strict=True))
        if (recording.force[:, :, i] > 0).any()
    ]
    if handles:
        placement = {"loc": "upper right", "bbox_to_anchor": (0.995, 0.995), "ncols": len(handles), "frameon": False}
        figure.legend(handles=handles, fontsize=8, handlelength=1.0, columnspacing=1.0, **placement)
    near = figure.add_axes((0.0, 0.0, 0.43, 0.91))
    complete = figure.add_axes((0.43, 0.0, 0.57, 0.91))
    pictures: list[Image.Image] = []
    for index in indices:
        for ax in (near, complete):
            for artist in (*ax.patches, *ax.lines, *ax.collections, *ax.texts):  # quicker than to clear the axes
                artist.remove()
            draw_moment(ax, recording, index, near=ax is near)
        figure.canvas.draw()
        picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")
        palette = pictures[0] if pictures else picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
        pictures.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
    with replacing(path) as temporary:
        pictures[0].save(
            temporary, "GIF", save_all=True, append_images=pictures[1:], duration=round(1e3 * step * PACE), loop=0
        )


@run_job
def main(job) -> None:
    """Rule `animation`."""
    write_animation(load_recording(job.input.ring), job.output[0])
