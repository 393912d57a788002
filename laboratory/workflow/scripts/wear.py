from trackdyn.sweeps.job import logged

from laboratory.inference.answer.settings import load_answer, question_unknowns
from laboratory.inference.unknowns import prior_points
from laboratory.report.figures.wear import life_figure, profile_figure, radius_figure
from laboratory.settings import WearForm
from laboratory.wear.study import run_lives, sensed, summarize, wear_answer, windows
from replication.report.tables import write_captioned_table
from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.plots.style import save

with logged(snakemake):
    given, form = snakemake.input, WearForm.model_validate(snakemake.params.form)
    named = {"shipped": load_rig(given.rig)}
    named |= {name: load_rig(path) for name, path in zip(snakemake.params.names, given.others, strict=True)}
    rigs = [(name, rig, {}, form.named) for name, rig in named.items()]
    if form.drawn_rigs:
        unknowns = question_unknowns(load_answer(given.answer), "possible")
        points = [unknowns.to_rig(x) for x in prior_points(unknowns, form.drawn_rigs)]
        rigs += [(f"drawn {k}", rig, {}, form.drawn) for k, rig in enumerate(points)]
    lives, flanks = run_lives(rigs, form, snakemake.params.store, snakemake.threads)
    seen = windows(lives)
    summary = summarize(lives, seen)
    message = wear_answer(summary, seen)
    write_csv(snakemake.output.csv, lives, float_format="%.7g")
    write_csv(snakemake.output.sensed, sensed(lives))
    write_captioned_table(summary, snakemake.output.summary, message)
    shown = "possible"  # friction of the others wears no real ring
    pictures = life_figure(lives, shown), profile_figure(named[shown], lives, flanks, shown), radius_figure(seen)
    for picture, path in zip(pictures, snakemake.output.figures, strict=True):
        save(picture, path)
    print(message)
