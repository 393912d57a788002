# The fit of a rig to the targets of config/fit.yaml.


rule fit_form:
    """Fit the rig to the targets of config/fit.yaml from many starts; rows are kept, so that a fit goes on where it was."""
    input:
        lab_needs("fit.py"),
        rig=POSSIBLE,
        fit="config/fit.yaml",
        kernels=[KERNELS, method_kernels("linearly_implicit")],
    output:
        starts=f"{L}/{{short}}fit/starts.csv",
        values=f"{L}/{{short}}fit/values.csv",
        targets=f"{L}/{{short}}fit/targets.csv",
    params:
        form=form_name,
        store=f"{L}/fit/rows",
    threads: 2
    log: f"{L}/logs/{{short}}fit.log"
    message: "Fitting the rig"
    script: "../scripts/fit.py"


rule fit:
    """The fit in full (an hour on two cores; ask for it by name)."""
    input:
        f"{L}/fit/starts.csv",
