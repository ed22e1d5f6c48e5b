"""Unusual words and values for all kinds of input."""

from __future__ import annotations

import re
import string

from hypothesis import strategies as st

NUMBERS = [
    "-1",
    "-0.5",
    "0.5",
    "1e3",
    "0x10",
    "1_000",
    "nan",
    "inf",
    "\u0661",
    "\u00bd",
    "9" * 20,
    "-" + "9" * 400,
    "9" * 5000,
]
SYMBOLS = [
    "",
    " ",
    "true",
    "null",
    "[1]",
    "{}",
    "--",
    "-",
    "=",
    "a=b",
    "a" * 5000,
    "a\nb",
    "%s%n",
    "{0}",
    "\U0001f4a5",
    "\x1b[2J",
    "\x7f",
]
PATHS = [
    "..",
    "../..",
    "/dev/null",
    "/proc/self/mem",
    "~",
    "$HOME",
    "study/study.toml",
    "no/such/file.nc",
    "x.avi",
]
TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=30)
_ODD_WORDS = st.sampled_from(NUMBERS) | st.sampled_from(SYMBOLS) | st.sampled_from(PATHS)
WORDS = _ODD_WORDS | TEXTS
# Hypothesis also draws constants of the tested code, such as "report". Every number, name and path
# that a command accepts consists of these characters.
INVALID_WORDS = _ODD_WORDS | TEXTS.filter(lambda text: not re.fullmatch(r"[\w./:@+-]+", text, re.A))

_keys = st.text(string.ascii_letters + "_.", max_size=12)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | WORDS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_keys, inner, max_size=3),
    max_leaves=6,
)
