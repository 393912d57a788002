# Random layouts: any number of wheels, arms and pitches is assembled, settled and run for a second, or refused.

LAYOUTS_A_PART = 100


def layout_parts(wildcards):
    """Files of the parts of a form that run side by side."""
    count = form_of("layouts", wildcards).count
    ends = [(first, min(first + LAYOUTS_A_PART, count)) for first in range(0, count, LAYOUTS_A_PART)]
    return [f"{R}/{wildcards.short}layouts/{first}-{last}.csv" for first, last in ends]


rule layouts_part:
    """Layouts of some numbers."""
    input:
        needs("layouts_part.py"),
        kernels=KERNELS,
    output: f"{R}/{{short}}layouts/{{first}}-{{last}}.csv"
    wildcard_constraints: first=r"\d+", last=r"\d+"
    log: f"{R}/logs/{{short}}layouts/{{first}}-{{last}}.log"
    message: "Layouts {wildcards.first} to {wildcards.last}"
    script: "../scripts/layouts_part.py"


rule layouts_form:
    """Layouts of all numbers."""
    input:
        needs("layouts.py"),
        parts=layout_parts,
    output:
        csv=f"{R}/{{short}}layouts.csv",
        summary=f"{R}/{{short}}tables/layouts.csv",
        md=f"{R}/{{short}}tables/layouts.md",
    log: f"{R}/logs/{{short}}layouts.log"
    message: "Layouts: how many run within the invariants"
    script: "../scripts/layouts.py"


rule layouts:
    """A thousand random layouts; by name, some fifteen minutes of a core."""
    input: full(rules.layouts_form)
