"""A small results folder."""

import pytest

TABLE = "run,rms_g,wall_s,loop_gap_max_m,note\n115rpm,0.924182,6.4,2.8e-14,\n150rpm,1.08251,7.1,3.1e-14,loose\n"
PAGE = "Table 3. Root mean square.\n\n| rpm | rms |\n|---|---|\n| 115 | 0.924 |\n| 150 | −1.08 |\n"


@pytest.fixture
def results(tmp_path):
    """Two figures, tables, a recording, files that hold times, and a further run below it."""
    folder = tmp_path / "results"
    for name in ("figures", "tables", "runs", "logs", "benchmarks", "kernels", "quick/kernels", "quick/tables"):
        (folder / name).mkdir(parents=True)
    for name, text in {
        "metrics.csv": TABLE,
        "tables/table3.csv": TABLE,
        "tables/table3.md": PAGE,
        "report.html": "<p>6 s</p></html>\n",
        "logs/a.md": "log",
        "benchmarks/a.csv": "s\n1\n",
        "quick/tables/table3.csv": "another run",
        "figures/fig24.svg": "<svg/>",
        "tables/.table4.0123abcd-77-77.trackdyn-part.csv": "half",
    }.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "runs" / "115rpm.npz").write_bytes(b"recording")
    (folder / "figures" / "fig24.png").write_bytes(b"picture")
    return folder
