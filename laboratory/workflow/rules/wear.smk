# How long the ring stays right (docs/wear.md). Lives are kept as they come: a study that is killed goes on where it was.

WEAR_FIGURES = ("life", "profile", "first_radius")


rule wear_form:
    """Lives of the rigs with a name and of rigs drawn within the ranges of the parts, from a new ring to a worn one."""
    input:
        lab_needs("wear.py"),
        rig=CONFIG.rig,
        others=[other.rig for other in CONFIG.other_rigs.values()],
        answer="config/answer.yaml",
        coefficients="laboratory/wear/coefficients.yaml",
        kernels=method_kernels("linearly_implicit"),
    output:
        csv=f"{L}/{{short}}wear_lives.csv",
        summary=f"{L}/{{short}}tables/wear.csv",
        md=f"{L}/{{short}}tables/wear.md",
        sensed=f"{L}/{{short}}wear_sensed.csv",
        **figures([f"wear_{name}" for name in WEAR_FIGURES], f"{LAB}{{short}}"),
    params:
        form=form("wear", LABORATORY),
        names=list(CONFIG.other_rigs),
        store=f"{L}/{{short}}wear",
    threads: 2
    log: f"{L}/logs/{{short}}wear.log"
    message: "Wear: how long the ring stays right"
    script: "../scripts/wear.py"


rule wear:
    """Lives in full; by name, some forty minutes of two cores."""
    input: full(rules.wear_form)
