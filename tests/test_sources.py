"""Hashes of sources without comments, and edits after an import."""

import os
import shutil
import time
from pathlib import Path

import pytest

from tests.conftest import python, written
from trackdyn import sources
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
LAYOUT = {
    "Of the module.": "Another", "Of the function.": "Another", "Of the class.": "Another", "pass": "pass  # so",
    "A, *B = 1, 1.5e-9,": "(A, *B) = 1, (1.5e-9),",
}  # fmt: skip
MEANING = {"1.5e-9": "1.6e-9", "1.0": "1", ":.3f": ":.4f", "np.vec": "np.Vec", "1 < 2": "1 <= 2", "/, ": ""}


@pytest.mark.parametrize(("old", "new"), (LAYOUT | MEANING).items())
def test_docstrings_comments_and_layout_mean_nothing_and_all_else_does(tmp_path, old, new):
    before, after = (written(tmp_path / f"{k}.py", text) for k, text in enumerate((TEXT, TEXT.replace(old, new))))
    assert before.read_bytes() != after.read_bytes() and (meaning(before) == meaning(after)) == (old in LAYOUT)


EDITED = """
import os, sys, time
from pathlib import Path
folder, inside, *steps = sys.argv[1:]
sys.path.insert(0, folder)
from trackdyn import sources
if inside == "inside":
    from trackdyn import ours
else:
    import ours
file = Path(ours.__file__)
for step in steps:
    text, _, age = step.partition(" @ ")
    if text == "read":
        sources.meaning(file)
    else:
        file.with_name("new").write_text(text)
        os.utime(file.with_name("new"), ns=(time.time_ns() - 10**9 * int(age or 0),) * 2)
        file.with_name("new").replace(file)
print(sources.edited([file]) == file)
"""
NO_EDITS = ["read"], [], ["read", "A = 1 # comment"], ["read", "A = 2", "A = 1"]
EDITS = [["A = 2", "read"], ["read", "A = 2"], ["read", "A = 2 @ 1000000"], ["read", "A = 2 @ -10000"], ["read", "A ="]]


@pytest.mark.parametrize("inside", ["inside", "outside"])
@pytest.mark.parametrize("age", [10**8, -10000])
@pytest.mark.parametrize("steps", [*NO_EDITS, *EDITS], ids=str)
def test_an_edit_after_the_import_is_known(tmp_path, inside, age, steps):
    """Before it is read, whatever it is; after that, if its meaning is another. A date in the future is no edit."""
    assert edited_after(tmp_path, inside, age, steps) is (steps in EDITS)


def test_a_file_of_the_package_that_is_swapped_for_an_older_one_is_edited(tmp_path):
    for age in (2000000, -10000):
        assert edited_after(tmp_path, "inside", 10**6, [f"A = 2 @ {age}", "read"])


def test_the_lock_of_an_editor_beside_a_source_disturbs_nothing(tmp_path):
    shutil.copytree(Path(sources.__file__).parent / "contact", tmp_path / "trackdyn/contact")
    digests = []
    for lock in (None, tmp_path / "trackdyn/contact/.#laws.py"):
        if lock:
            lock.symlink_to("me@here.1234:5678")
        assert not edited_after(tmp_path, "inside", 10**6, ["read"])
        digests.append(python("from trackdyn import sources; print(sources.kernel_digest())", cwd=tmp_path).out)
    assert digests[0] == digests[1] != ""


def edited_after(folder, inside, age, steps):
    """Whether a module is edited after these steps: it is read, or replaced by a text of some age, s."""
    (folder / "trackdyn").mkdir(exist_ok=True)
    (folder / "trackdyn/__init__.py").touch()
    shutil.copy(sources.__file__, folder / "trackdyn")
    ours = folder / ("trackdyn/ours.py" if inside == "inside" else "ours.py")
    ours.write_text("A = 1")
    os.utime(ours, ns=(time.time_ns() - 10**9 * age,) * 2)
    return python(EDITED, folder, inside, *steps).out == "True\n"


def test_the_files_of_a_row_are_these():
    files = module_files("trackdyn.sweeps.sweep_row")
    assert Path(sources.__file__) in files and len(files) > 50 and edited(files) is None


HASHES = """
import sys
from trackdyn import sources
parsed = []
sources._meaning_of_python = lambda content, of=sources._meaning_of_python: parsed.append(1) or of(content)
print(sources.module_hash("trackdyn.rig.rig"), len(parsed))
"""


def test_hashes_are_those_of_the_files_whatever_an_earlier_process_kept(tmp_path):
    def hashed():
        return python(HASHES, TRACKDYN_CACHE=str(tmp_path)).out.split()

    (right, parsed), (again, none) = hashed(), hashed()
    (file,) = tmp_path.glob("sources-*.json")
    file.write_bytes(file.read_bytes().replace(b"a", b"b"))
    assert again == right and int(parsed) > 10 and int(none) == 0
    assert hashed() == [right, parsed]
