# How long the ring stays right (docs/wear.md). Lives are kept as they come: a study that is killed goes on where it was.

WEAR_FIGURES = ("life", "profile", "first_radius")


rule wear_form:
    """Lives of the rigs with a name and of rigs of the ensemble, from a new ring to a worn one."""
    input:
        needs("wear.py"),
        rig=CONFIG.rig,
        ranges=POSSIBLE,
        others=[other.rig for other in CONFIG.other_rigs.values()],
        ensemble="config/ensemble.yaml",
        coefficients="laboratory/wear/coefficients.yaml",
        kernels=method_kernels("linearly_implicit"),
    output:
        csv=f"{R}/{{short}}wear_lives.csv",
        summary=f"{R}/{{short}}tables/wear.csv",
        md=f"{R}/{{short}}tables/wear.md",
        sensed=f"{R}/{{short}}wear_sensed.csv",
        figures=[file for name in WEAR_FIGURES for file in figure(f"wear_{name}", "{short}")],
    params:
        form=form("wear"),
        names=list(CONFIG.other_rigs),
        store=f"{R}/{{short}}wear",
    threads: 2
    log: f"{R}/logs/{{short}}wear.log"
    message: "Wear: how long the ring stays right"
    script: "../scripts/wear.py"


rule wear:
    """Lives in full; by name, some forty minutes of two cores."""
    input: full(rules.wear_form)


rule wear_pages:
    """Measured part and pictures of docs/wear.md from the present results. Asked for by name, as `pictures` is."""
    input:
        lives=f"{R}/wear_lives.csv",
        pictures=[f"{R}/figures/wear_{name}.png" for name in WEAR_FIGURES],
    log: f"{R}/logs/wear_pages.log"
    message: "Measured part of the page on wear"
    shell:
        "{sys.executable} -m replication.report.filled {input.lives} {input.pictures} > {log} 2>&1"
