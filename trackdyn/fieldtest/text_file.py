"""Text of a logger's file: unpacked, decoded, with line ends, comments, stamps and exponents in one form."""

import gzip
import re
import zlib
from contextlib import suppress
from pathlib import Path

from trackdyn.fieldtest.stamps import DATE
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import plain_file

MAX_TEXT_BYTES = 128_000_000  # an hour of three axes at 1 kHz; the text and its numbers take some ten times that
# encodings of two or four bytes, by their byte order mark or by the zero bytes around the first letter
_WIDE = {
    "utf-32": rb"\xff\xfe\0\0|\0\0\xfe\xff", "utf-16": rb"\xff\xfe|\xfe\xff",
    "utf-16-le": rb"[!-~]\0[ -~]\0", "utf-16-be": rb"\0[!-~]\0[ -~]",
}  # fmt: skip
_PAGE = "docs/your-loggers-file.md has the lines that turn it into a table"
_REMEDIES = {
    "JSON": "pandas.read_json makes a table of it", "a web page": "save the table itself as CSV",
    "a Git LFS pointer": "`git lfs pull` downloads the file", "a recording": "give the sensor's file",
    "messages in YAML": "`rostopic echo -p` writes a table", "an old spreadsheet": "save the sheet as CSV",
    "an archive or a spreadsheet": "unpack it, or save the sheet as CSV",
}  # fmt: skip
# first bytes of formats that are refused
_OTHERS = {
    "MDF": rb"MDF     |UnFinMF ", "TDMS": rb"TDSm", "LVM": rb"(\xef\xbb\xbf)?LabVIEW Measurement",
    "UFF": rb"\s*    -1\s*\r?\n\s*\d{1,4}b?\s", "HDF5": rb"\x89HDF\r\n\x1a\n", "MATLAB": rb"MATLAB [57]\.",
    "Parquet": rb"PAR1", "NumPy": rb"\x93NUMPY", "WAV": rb"RIFF|RIFX|RF64", "EDF": rb"0       ", "BDF": rb"\xffBIOSEMI",
    "a SQLite database": rb"SQLite format 3", "an old spreadsheet": rb"\xd0\xcf\x11\xe0",
    "a recording": rb"PK.{28}meta\.npy", "JSON": rb"\s*(\{|\[\s*[\[{])",
    "an archive or a spreadsheet": rb"PK\x03\x04|BZh|\xfd7zXZ|7z\xbc\xaf|Rar!|\x28\xb5\x2f\xfd|\x1f\x8b",
    "messages in YAML": rb"header:\s*\n +\w+:",
    "a web page": rb"(?i)\s*<(!doctype|html)", "a Git LFS pointer": rb"version https://git-lfs",
}  # fmt: skip
_CONTROL = bytes(byte for byte in range(32) if byte not in b"\t\n\v\f\r\x1a")
# a serial monitor's stamp in front of a line
_STAMPED = re.compile(
    rf"^[ \t]*(?:\[(?P<boxed>{DATE.pattern})\]|(?P<stamp>{DATE.pattern}) ->)[ \t]*(?P<rest>.*)$",
    re.ASCII | re.MULTILINE,
)
_CHECKSUM = re.compile(r"\$\w+,.*\*[0-9A-Fa-f]{2}\s*")  # sentence of NMEA 0183
_FORTRAN = re.compile(r"(?<![\w.])([+-]?\d{1,20}\.\d{0,20})[dD]([+-]?\d{1,3})(?!\w)", re.ASCII)
_SIGNS = str.maketrans({"\N{NO-BREAK SPACE}": " ", "\N{NARROW NO-BREAK SPACE}": " ", "\N{MINUS SIGN}": "-"})


def read_logger_text(path: Path) -> str:
    """Read a text file of at most ``MAX_TEXT_BYTES``, perhaps packed by gzip, and normalise it; or `InputError`.

    UTF-8, UTF-16, UTF-32, Shift-JIS or Latin-1: numbers are the same in all of them, names and units may not be.
    """
    plain_file(path, "CSV file")
    try:
        with path.open("rb") as file, gzip.GzipFile(fileobj=file) as unpacked:
            packed = file.read(2) == b"\x1f\x8b"
            file.seek(0)
            data = (unpacked if packed else file).read(MAX_TEXT_BYTES + 1)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InputError(f"{path}: the gzip file is damaged ({error}); pack it again.") from None
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check its permissions.") from None
    kind = next((kind for kind, begin in _OTHERS.items() if re.match(begin, data, re.DOTALL)), "")
    wide = next((name for name, begin in _WIDE.items() if re.match(begin, data)), "")
    if not (kind or wide) and len(data) - len(data.translate(None, _CONTROL)) > 0.02 * len(data):
        kind = "binary data"
    if kind:
        raise InputError(f"{path}: this is {kind}, not a table in text; {_REMEDIES.get(kind, _PAGE)}.")
    if len(data) > MAX_TEXT_BYTES:
        raise InputError(f"{path}: the file has more than {MAX_TEXT_BYTES / 1e6:.0f} MB; give a part of it.")
    with suppress(UnicodeDecodeError):
        return _normalised(data.decode(wide or "utf-8-sig"))
    text = data.decode("latin-1")
    if re.search("[\x80-\x9f]", text[:10_000]):  # no letters of Latin-1, but halves of Japanese ones
        with suppress(UnicodeDecodeError):
            text = data.decode("cp932")
    return _normalised(text)


def _normalised(text: str) -> str:
    """Normalise line ends, blanks, signs, quotes, comments to ``#``, exponents to ``e``; move a monitor's stamps."""
    text = re.sub("\r*\n|\r", "\n", text).translate(_SIGNS)
    head = text.split("\n", 200)[:200]
    if '="' in text:
        text = re.sub(r'="([^"\n]*)"', r"\1", text)
    written = [line for line in head if line.strip()]
    if written and all(re.fullmatch(r'"(?=[^"]*[,;\t])([^"]|"")*"[,; ]*', line) for line in written):
        text = re.sub(r'(?m)^"((?:[^"\n]|"")*)"[,; ]*$', lambda line: line[1].replace('""', '"'), text)
    if any(map(_FORTRAN.search, head)):
        text = _FORTRAN.sub(r"\1e\2", text)
    if written and all(map(_CHECKSUM.fullmatch, written[:-1])):
        text = re.sub(r"\*[0-9A-Fa-f]{2}[ \t]*$", "", text, flags=re.MULTILINE)
    stamped = [line["rest"] for line in map(_STAMPED.match, head) if line]
    if len(stamped) > len(head) / 2:
        sign = next((sign for sign in "\t;, " if sign in stamped[-1]), ",")

        def stamp_last(line: re.Match[str]) -> str:
            rest, stamp = line["rest"], line["boxed"] or line["stamp"]
            return stamp + rest if rest.startswith((",", ";")) else f"{rest}{sign}{stamp}"

        text = _STAMPED.sub(stamp_last, text)
    # where another sign begins comments, no row contains it
    mark = next((mark for mark in (";", "%", "//") if text.startswith(mark)), None)
    if mark is None or any(mark in line for line in head if not line.lstrip().startswith(mark)):
        return text
    return re.sub(rf"^[ \t]*{mark}", "#", text, flags=re.MULTILINE)
