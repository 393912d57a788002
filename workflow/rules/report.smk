# The page that shows everything, and the moving picture. Included last: it looks at the rules before it.
from trackdyn.paper.contents import OWN, PAPER

# no ring, the smallest, the paper's and the largest one, at every speed of the ring study
STUDIED = CONFIG.ring_study.radii_m
ANIMATION_RADII = [None] + sorted({STUDIED[0], CONFIG.records.ring_radius_m, STUDIED[-1]})
ANIMATION_SCENES = {
    f"animation/{rpm:g}rpm_{'none' if radius is None else f'{radius:.4g}'}": {
        "motor_rpm": rpm,
        "ring_radius": radius,
        "lead_in": 2.0,
        "step": CONFIG.ring_study.step_s,
        "frame_interval": 0.01,
    }
    for rpm in CONFIG.ring_study.speeds_rpm
    for radius in ANIMATION_RADII
}
ANIMATED = f"animation/{CONFIG.ring_study.speeds_rpm[0]:g}rpm"


def files_of(folder, *endings):
    found = (Path(workflow.basedir) / folder).iterdir()
    return sorted(f"{folder}/{path.name}" for path in found if path.suffix in endings)


def shown_on_the_page(wildcards):
    """Figures and tables of the paper that the rules included so far make, and the studies that were asked for."""
    names = {f"{R}/tables/{item.key}.csv" for item in PAPER}
    names |= {f"{R}/figures/{item.key}.png" for item in (*PAPER, *OWN)}
    made = {str(file) for rule in workflow.rules for file in rule.output}
    names |= {f"{R}/tables/fidelity.csv", f"{R}/short/trade.csv"}
    asked = [f"{R}/trade.csv"]  # by name: shown if it is there
    return sorted(names & made) + [path for path in asked if Path(path).exists()]


rule animation_runs:
    """Short runs in steady motion with every pitch recorded."""
    input:
        SIMULATOR,
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        [recording(run) for run in ANIMATION_SCENES],
    params:
        scenes=list(ANIMATION_SCENES.values()),
    log:
        f"{R}/logs/animation_runs.log",
    benchmark:
        f"{R}/benchmarks/animation_runs.tsv"
    message:
        "Runs for the moving picture"
    script:
        "../scripts/animation_runs.py"


rule animation:
    """One turn of the sprocket as a GIF, and still pictures."""
    input:
        sources("report/style.py", "report/drawing.py", "report/figures/animation.py", "report/figures/screenshots.py"),
        ring=recording(f"{ANIMATED}_{CONFIG.records.ring_radius_m:.4g}"),
        no_ring=recording(f"{ANIMATED}_none"),
    output:
        gif=report(f"{R}/figures/animation.gif", caption="../report/animation.rst", category="Rig and costs"),
        loop=multiext(f"{R}/figures/still_loop", ".png", ".svg"),
        sprocket=multiext(f"{R}/figures/still_sprocket", ".png", ".svg"),
        no_ring=multiext(f"{R}/figures/still_no_ring", ".png", ".svg"),
    log:
        f"{R}/logs/animation.log",
    benchmark:
        f"{R}/benchmarks/animation.tsv"
    message:
        "The loop in motion"
    script:
        "../scripts/animation.py"


rule page:
    """One page with the scorecard, charts, the moving loop, all figures and tables, and where they come from."""
    input:
        MEASURES,
        sources("report", "paper"),
        files_of("trackdyn/report/page", ".js", ".css", ".j2"),
        files_of("workflow/report", ".rst"),
        rules.records.input,
        rules.ring.input,
        rules.claims.output,
        rules.sensitivity.output,
        rules.costs.output,
        rules.animation_runs.output,
        shown_on_the_page,
        rig=CONFIG.rig,
        config=[str(path) for path in workflow.configfiles],
        settings=["config/claims.yaml", "config/fit.yaml"],
        sensors=[CONFIG.sensor_path(rpm) for rpm in CONFIG.records.speeds_rpm],
    output:
        f"{R}/report.html",
    params:
        results=R,
        runs=SPEEDS,
        synthetic=CONFIG.sensor_is_synthetic,
        captions="workflow/report",
    log:
        f"{R}/logs/page.log",
    benchmark:
        f"{R}/benchmarks/page.tsv"
    message:
        "The page"
    script:
        "../scripts/page.py"


rule report_page:
    input:
        rules.page.output,
        rules.animation.output,
