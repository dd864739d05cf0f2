"""Values that break readers: numbers, texts and paths, as bytes of a text file and as integers of a binary one."""

from __future__ import annotations

OUTSIDE = "fuzz-outside"
"""The name of a file beside the folder of a case, and of one of the machine: no reader may open them."""
FOREIGN = "/etc/hostname"

NUMBERS = (
    "0", "-0", "1", "-1", "2", "255", "65536", "2147483647", "-2147483648", "4294967295", "9007199254740993",
    "18446744073709551616", "1e-320", "1e38", "3.5e38", "1e150", "1e300", "-1e300", "1e308", "1e309", "-1e400", "nan", "NaN",
    "inf", "-inf", "Infinity", "9" * 400, "9" * 5000, "0." + "0" * 400 + "1", "0x10", "1_000", "٣", "1e", "--1", "1,5", "true",
    "null", "", "0 0 0 0", "1/2/3/4",
)  # fmt: skip
TEXTS = (
    "", " ", "\0", "\x1b[2J", "\u202ereversed", "a" * 5000, "a" * 100_000, "é", "\ud800".encode("utf-8", "surrogatepass").hex(),
    "../" + OUTSIDE, "../../" + OUTSIDE, FOREIGN, "file://" + FOREIGN, "..", ".", "/", "~", "C:\\x", "a/../../" + OUTSIDE,
    "/dev/zero", "/dev/stdin", "http://localhost:9/x", "data:,x", "data:image/png;base64,AAAA", "%2e%2e/" + OUTSIDE, "*",
    "'; DROP TABLE items; --",
    "<b>", "]]>", "{}", "[]", "${HOME}", "%s%s%n", "null", "True",
)  # fmt: skip
INTEGERS = (0, 1, 2, 3, 4, 7, 16, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0xFFFFFF, 0x3FFFFFFF, 0x7FFFFFFF, 0x80000000,
            0xFFFFFFFF, 0xFFFFFFFE, 0x100000000, 0x7FFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF, 1_000_000, 50_000_000)  # fmt: skip
