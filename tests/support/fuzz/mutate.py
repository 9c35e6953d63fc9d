"""Damages a file as disks, editors, export filters and people do, and as somebody would who means harm; by a seed."""

from __future__ import annotations

import random
import re
import struct

NUMBERS = [
    *b"nan inf -inf 1e200 -1e308 1e400 5e-324 0 -0 -1 1e6 1e9 65536 2147483648".split(),
    *b"1_000 0x10 1,5 1.5.2 1e 1e5 2e-3 --3 true [1]".split(),
    *(b"9" * 5000, "²".encode(), "٣".encode(), b"", b"1" + b"0" * 400, b'"1"'),
]
WORDS = [
    b"",
    b"../../../x",
    b"/etc/passwd",
    b"a/b",
    b"\0",
    b"\x1b[31m",
    b"\x1a",
    b"x" * 5000,
    b"<script>",
    "é".encode("latin-1"),
    "Ω漢".encode(),
    b"\xed\xa0\x80",
    b"%s{0}",
    b"\n",
    b"\t",
    b'"',
    b"&lol;",
    b"time",
    b"Frame#",
    b"endheader",
    b"ground",
    b"*",
    b"**x",
]
NESTS = [
    (b"[", b"]"),
    (b"{a=", b"}"),
    (b"<a>", b"</a>"),
    (b"<components>", b"</components>"),
    (b"a.", b""),
    (b"[[", b"]]"),
]
ENCODINGS = ("utf-16", "utf-32", "latin-1", "cp037", "utf-8-sig", "utf-7", "shift_jis")
NAMED = (b"utf-7", b"utf-32", b"shift_jis", b"idna", b"nonsense", b"utf-16", b"latin-1", b"ascii", b"hex", b"zlib")
_NUMBER = re.compile(rb"[-+]?[0-9]+\.?[0-9]*(?:[eE][-+]?[0-9]+)?")
_WORD = re.compile(rb"[A-Za-z_][A-Za-z0-9_.#]*")
LARGEST = 2_000_000  # bytes: a larger file takes time in proportion, and finds nothing more


def mutated_text(content: bytes, other: bytes, rng: random.Random) -> bytes:
    """One to four damages of a text file; ``other`` is another file that pieces are taken from."""
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 4))):
        content = rng.choice(_TEXT)(content, other, rng)[:LARGEST]
    return content


def mutated_c3d(content: bytes, other: bytes, rng: random.Random) -> bytes:
    """One to six damages of a C3D, most of them in its header and parameters."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 3, 4, 6))):
        data = rng.choice(_BINARY)(data, other, rng)
    return bytes(data[:LARGEST])


def _bytes(content: bytes, other: bytes, rng: random.Random) -> bytes:
    data = bytearray(content or b"x")
    for _ in range(rng.randint(1, 8)):
        k = rng.randrange(len(data) or 1)
        what = rng.randrange(3)
        if what == 0:
            data[k : k + 1] = bytes([rng.randrange(256)])
        elif what == 1:
            data[k : k + rng.randint(1, 20)] = b""
        else:
            data[k:k] = rng.randbytes(rng.randint(1, 5))
    return bytes(data)


def _lines(content: bytes, other: bytes, rng: random.Random) -> bytes:
    lines = content.split(b"\n")
    k = rng.randrange(len(lines))
    what = rng.randrange(6)
    if what == 0:
        del lines[k]
    elif what == 1:
        lines[k:k] = [lines[k]] * rng.choice((1, 1, 3, 3000))
    elif what == 2:
        m = rng.randrange(len(lines))
        lines[k], lines[m] = lines[m], lines[k]
    elif what == 3:
        lines[k] = rng.choice(other.split(b"\n"))
    elif what == 4:
        lines = lines[:k]
    else:
        lines = lines[k:]
    return b"\n".join(lines)


def _replaced(pattern: re.Pattern[bytes], by: list[bytes], content: bytes, rng: random.Random) -> bytes:
    found = [match.span() for match in pattern.finditer(content)]
    for begin, end in sorted(rng.sample(found, min(len(found), rng.choice((1, 1, 2, 20)))), reverse=True):
        content = content[:begin] + rng.choice(by) + content[end:]
    return content


def _numbers(content: bytes, other: bytes, rng: random.Random) -> bytes:
    return _replaced(_NUMBER, NUMBERS, content, rng)


def _words(content: bytes, other: bytes, rng: random.Random) -> bytes:
    own = [match[0] for match in _WORD.finditer(content)] or [b"x"]
    return _replaced(_WORD, [*WORDS, *rng.sample(own, min(len(own), 8))], content, rng)


def _repeated(content: bytes, other: bytes, rng: random.Random) -> bytes:
    begin = rng.randrange(len(content) + 1)
    piece = content[begin : begin + rng.randint(1, 300)]
    return content[:begin] + piece * rng.choice((2, 10, 1000)) + content[begin:]


def _nested(content: bytes, other: bytes, rng: random.Random) -> bytes:
    begin, end = rng.choice(NESTS)
    depth = rng.choice((30, 300, 5000, 20000))
    k = rng.choice([0, len(content), *(match.start() for match in re.finditer(rb"[\n>=]", content))]) + rng.randrange(2)
    return content[:k] + begin * depth + rng.choice((b"", b"1")) + end * rng.choice((0, depth)) + content[k:]


def _encoded(content: bytes, other: bytes, rng: random.Random) -> bytes:
    if rng.random() < 0.5 and b"encoding=" in content:
        return re.sub(rb'encoding="[^"]*"', b'encoding="' + rng.choice(NAMED) + b'"', content)
    return content.decode("utf-8", "replace").encode(rng.choice(ENCODINGS), "replace")


def _parted(content: bytes, other: bytes, rng: random.Random) -> bytes:
    separators = (b"\t", b" ", b",", b";", b"\n", b"\r\n", b"\r", b"=", b".")
    return content.replace(rng.choice(separators), rng.choice(separators), rng.choice((1, -1)))


def _rescaled(content: bytes, other: bytes, rng: random.Random) -> bytes:
    """One column times a power of ten, as with another unit; or all numbers."""
    factor, column = 10.0 ** rng.choice((-9, -6, -3, 3, 6, 9, 200)), rng.randrange(12)
    everything = rng.random() < 0.1
    lines = content.split(b"\n")
    for k, line in enumerate(lines):
        separator = b"\t" if b"\t" in line else b","
        cells = line.split(separator)
        for c in range(len(cells)) if everything else (column,):
            if c < len(cells) and _NUMBER.fullmatch(cells[c].strip()):
                cells[c] = f"{factor * float(cells[c]):.9g}".encode()
        lines[k] = separator.join(cells)
    return b"\n".join(lines)


def _spliced(content: bytes, other: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)] + other[rng.randrange(len(other) + 1) :]


_TEXT = (_bytes, _lines, _numbers, _numbers, _words, _words, _repeated, _nested, _encoded, _parted, _rescaled, _spliced)

_BYTES = (0, 1, 2, 3, 0x7F, 0x80, 0xFF)
_FLOATS = (float("nan"), float("inf"), float("-inf"), 1e30, -1e30, 1e-30, 0.0, -1.0, 1e6, 3e38)


def _in_header(data: bytearray, other: bytes, rng: random.Random) -> bytearray:
    data[rng.randrange(min(24, len(data)))] = rng.choice((*_BYTES, rng.randrange(256)))
    return data


def _in_parameters(data: bytearray, other: bytes, rng: random.Random) -> bytearray:
    k = rng.randrange(min(len(data), 512), max(min(len(data), 6000), 513))
    if k < len(data):
        data[k] = rng.choice((*_BYTES, rng.randrange(256)))
    return data


def _float(data: bytearray, other: bytes, rng: random.Random) -> bytearray:
    for _ in range(rng.choice((1, 1, 30))):
        k = rng.randrange(0, max(len(data) - 4, 1)) & ~(3 if rng.random() < 0.8 else 0)
        data[k : k + 4] = struct.pack("<f", rng.choice(_FLOATS))
    return data


def _of_other(data: bytearray, other: bytes, rng: random.Random) -> bytearray:
    k, size = rng.randrange(len(data)), rng.choice((1, 8, 64, 512))
    data[k : k + size] = other[k : k + size]
    return data


def _cut(data: bytearray, other: bytes, rng: random.Random) -> bytearray:
    k, size = rng.randrange(len(data)), rng.choice((1, 2, 100, 512, len(data)))
    return data[:k] + data[k + size :] or bytearray(1)


def _put(data: bytearray, other: bytes, rng: random.Random) -> bytearray:
    k = rng.randrange(len(data))
    data[k:k] = rng.randbytes(rng.choice((1, 2, 100, 512)))
    return data


_BINARY = (_in_header, _in_parameters, _in_parameters, _in_parameters, _float, _float, _of_other, _cut, _put)
