# How the ring wears (docs/wear.md): a job a life, by the command that a user has.

WEAR_RIGS = {Path(CONFIG.rig).stem: CONFIG.rig, **{name: other.rig for name, other in CONFIG.other_rigs.items()}}
WEAR_LIFE = f"{L}/{{short}}wear/{{rig}}_{{rpm}}_{{tension}}_{{radius}}.parquet"


def wear_lives(wildcards):
    """Tables of all lives of a form."""
    form = form_of("wear", wildcards, LABORATORY)
    about = {"rpm": form.speeds_rpm, "tension": form.tensions, "radius": form.first_radii_m}
    return expand(WEAR_LIFE, short=wildcards.short, rig=WEAR_RIGS, **about)


rule wear_life:
    """The life of one rig at one speed, from a new ring to a worn one."""
    input:
        needs("wear.py", "laboratory/commands"),
        "laboratory/wear/coefficients.yaml",
        rig=lambda wildcards: WEAR_RIGS[wildcards.rig],
        kernels=method_kernels("linearly_implicit"),
    output: WEAR_LIFE
    params:
        form=form("wear", LABORATORY),
        python=sys.executable,
    wildcard_constraints:
        rig="|".join(WEAR_RIGS),
        tension="[a-z]+",
    log: f"{L}/logs/{{short}}wear/{{rig}}_{{rpm}}_{{tension}}_{{radius}}.log"
    message: "Wear: {wildcards.rig}, {wildcards.rpm} rpm, {wildcards.tension}, {wildcards.radius} m"
    shell:
        "{params.python} -m trackdyn wear {input.rig} --out {output} --overwrite --rpm {wildcards.rpm} "
        "--ring-radius {wildcards.radius} --tension {wildcards.tension} --preset fast --step {params.form[step_s]} "
        "--until-radius {params.form[until_radius_m]} > {log} 2>&1"


rule wear_form:
    """All lives in one table, and what changes over some of them as a figure."""
    input:
        lab_needs("report/figures/wear.py"),
        lives=wear_lives,
    output:
        csv=f"{L}/{{short}}wear_lives.csv",
        **figures(["wear_life"], f"{LAB}{{short}}"),
    log: f"{L}/logs/{{short}}wear.log"
    message: "Wear: the lives"
    script: "../report/figures/wear.py"


rule wear:
    """Lives in full; by name, some twenty minutes of one core."""
    input: full(rules.wear_form)
