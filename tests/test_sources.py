"""What a file means is its hash, and what was edited after it was imported is known."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from trackdyn.sources import edited, meaning, module_files

TEXT = """
'''Of the module.'''
from __future__ import annotations
import numpy as np, os.path
A, *B = 1, 1.5e-9, -2j, ..., None, True, b"\\x00", "\u00e9\\n", 0x10, 1_000
@np.vectorize
async def f(a, /, b: int = 1, *c, d=None, **e) -> None:
    '''Of the function.'''
    async with a as b, c: await d
    async for i in b: yield i
    else: pass
class C(object, metaclass=type):
    '''Of the class.'''
    x: float = 1.0
    def g(self): return lambda *, k=1: (k := 2) if self else {**{}, 1: [*B]}
try:
    raise ValueError from None
except (ValueError, TypeError) as error: del error
finally: assert A, "no"
match A:
    case {"a": 1, **rest} | [C(x=1.0), *_] if A > 1 < 2 is not 3: global z
    case _: z = f"{A!r:>{B}} and {A=}" "more" rf"\\{B}" f"{A:.3f}{B}"
while not A and B or ~A: break
with open(A[1:2, ::3]) as B.c: B @= {i for i in B if i for j in i}
"""


@pytest.fixture
def hash_of(tmp_path):
    """`meaning` of a text, in a file of its own."""

    def of(text, name=iter(range(100))):
        path = tmp_path / f"{next(name)}.py"
        path.write_text(text, encoding="utf-8")
        return meaning(path)

    return of


@pytest.mark.parametrize("name", ["module", "function", "class"])
def test_docstrings_comments_and_layout_mean_nothing(hash_of, name):
    for same in (
        TEXT.replace(f"Of the {name}.", "Another"),
        TEXT.replace("pass", "pass  # so"),
        TEXT.replace("A, *B = 1,", "(A, *B) = (1,").replace("1_000", "1000)"),
    ):
        assert same != TEXT and hash_of(same) == hash_of(TEXT)


@pytest.mark.parametrize(
    ("old", "new"),
    [("1.5e-9", "1.6e-9"), ("1.0", "1"), (":.3f", ":.4f"), ("np.vec", "np.Vec"), ("1 < 2", "1 <= 2"), ("/, ", "")],
)
def test_all_else_does(hash_of, old, new):
    assert TEXT.replace(old, new) != TEXT and hash_of(TEXT.replace(old, new)) != hash_of(TEXT)


EDITED = """
import os, sys
from pathlib import Path
from trackdyn import sources
sys.path.insert(0, sys.argv[1])
import ours
file = Path(sys.argv[1], "ours.py")
def write(text):
    file.write_text(text)
    os.utime(file, ns=(sources.BEGAN + 10**9,) * 2)
if sys.argv[2] == "before":
    write("A = 2")
sources.meaning(file)
for text in sys.argv[3:]:
    write(text)
print(sources.edited([file]) == file)
"""


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (["before"], True),
        (["after", "A = 2"], True),
        (["after", "A = 1 # comment"], False),
        (["after", "A = 2", "A = 1"], False),
        (["after", "A ="], True),
        (["after"], False),
    ],
)
def test_an_edit_after_the_import_is_known(tmp_path, texts, expected):
    """Before the hash is taken, whatever it is; after that, if the meaning is another."""
    (tmp_path / "ours.py").write_text("A = 1")
    os.utime(tmp_path / "ours.py", (0, 0))
    run = [sys.executable, "-c", EDITED, str(tmp_path), *texts]
    assert subprocess.run(run, capture_output=True, text=True, check=True).stdout == f"{expected}\n"


def test_the_files_of_a_row_are_these():
    files = module_files("trackdyn.sweeps.sweep_row")
    assert Path(sys.modules["trackdyn.sources"].__file__) in files and len(files) > 50
    assert edited(files) is None
