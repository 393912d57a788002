# Random layouts: any number of wheels, arms and pitches is assembled, settled and run for a second, or refused.

LAYOUT_FORMS = {"full": 1000, "short": 20}
LAYOUTS_A_PART = 100


def layout_parts(form):
    """Files of the parts of a form that run side by side."""
    return [f"{R}/layouts/{first}-{min(first + LAYOUTS_A_PART, LAYOUT_FORMS[form])}.csv" for first in range(0, LAYOUT_FORMS[form], LAYOUTS_A_PART)]


rule layouts_part:
    """Layouts of some numbers."""
    input:
        needs("layouts_part.py"),
        kernels=KERNELS,
    output: f"{R}/layouts/{{first}}-{{last}}.csv"
    wildcard_constraints: first=r"\d+", last=r"\d+"
    log: f"{R}/logs/layouts/{{first}}-{{last}}.log"
    message: "Layouts {wildcards.first} to {wildcards.last}"
    script: "../scripts/layouts_part.py"


rule layouts:
    """A thousand random layouts; by name, some fifteen minutes of a core."""
    input:
        needs("layouts.py"),
        parts=layout_parts("full"),
    output: csv=f"{R}/layouts.csv", summary=f"{R}/tables/layouts.csv", md=f"{R}/tables/layouts.md"
    log: f"{R}/logs/layouts.log"
    message: "Layouts: how many of a thousand run within the invariants"
    script: "../scripts/layouts.py"


use rule layouts as layouts_short with:
    input:
        needs("layouts.py"),
        parts=layout_parts("short"),
    output: csv=f"{R}/short/layouts.csv", summary=f"{R}/short/tables/layouts.csv", md=f"{R}/short/tables/layouts.md"
    log: f"{R}/logs/layouts_short.log"
    message: "Layouts in short"
