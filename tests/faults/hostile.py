"""Words and values that nobody means, for whatever asks for some."""

from __future__ import annotations

import string

from hypothesis import strategies as st

WORDS = st.one_of(
    st.sampled_from(
        ["", " ", "-1", "-0.5", "0.5", "1e3", "0x10", "1_000", "nan", "inf", "true", "null", "[1]", "{}", "--", "-", "=", "a=b"]
    ),
    st.sampled_from(
        ["\u0661", "\u00bd", "99999999999999999999", "-" + "9" * 400, "9" * 5000, "a" * 5000, "a\nb", "%s%n", "{0}", "\U0001f4a5"]
    ),
    st.sampled_from(
        ["../..", "/dev/null", "/proc/self/mem", "~", "$HOME", "study/study.toml", "no/such/file.nc", "x.avi", "\x1b[2J", "\x7f"]
    ),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=30),
)

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | WORDS,
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(string.ascii_letters + "_.", max_size=12), inner, max_size=3)
    ),
    max_leaves=6,
)
