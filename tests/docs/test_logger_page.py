"""The lines of the page on loggers' files make a table that is the record."""

import re

import numpy as np
import pandas as pd
import pytest
import scipy.io
import scipy.io.wavfile

from tests.conftest import ROOT
from trackdyn.fieldtest.sensor_csv import read_sensor
from trackdyn.fieldtest.sensor_mapping import SensorMapping

PAGE = (ROOT / "docs" / "your-loggers-file.md").read_text(encoding="utf-8")
BLOCKS = [block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if '("record.' in block]
T = np.arange(2000) / 1000
COUNTS = np.round(8192 * (1 + np.sin(2 * np.pi * 3 * T))).astype(np.int16)
WRITERS = {
    "record.mat": lambda: scipy.io.savemat("record.mat", {"t": T, "ay": COUNTS}),
    "record.wav": lambda: scipy.io.wavfile.write("record.wav", 1000, COUNTS),
    "record.csv": lambda: pd.DataFrame(COUNTS.reshape(-1, 8)).add_prefix("y[").add_suffix("]").to_csv("record.csv"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_the_lines_of_a_format_make_the_record(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    WRITERS[name]()
    (block,) = [block for block in BLOCKS if f'"{name}"' in block]
    made = {}
    exec(block, made)
    timed = {"time": "none", "rate": made["rate"]} if "rate" in made else {}
    record = read_sensor(made["frame"], SensorMapping(scale=8192, **timed))
    np.testing.assert_allclose(record.ay, COUNTS / 8192)
    assert record.rate == pytest.approx(1000) and len(BLOCKS) == len(WRITERS)
