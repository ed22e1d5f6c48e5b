"""Write the results into docs/development/benchmarks.md: `python -m benchmarks.publish`."""

from __future__ import annotations

import argparse
import re
import shutil
from pathlib import Path

from benchmarks.compare import OUTPUT_FOLDER
from benchmarks.machine import ROOT

PAGE = ROOT / "docs" / "development" / "benchmarks.md"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    arguments.add_argument(
        "--out",
        type=Path,
        default=OUTPUT_FOLDER,
        help="folder of the results of `compare` and `scaling`",
    )
    out = arguments.parse_args().out
    page = PAGE.read_text("utf-8")
    for name in ("comparison", "scaling"):
        page = fill_section(page, name, (out / f"{name}.md").read_text("utf-8"))
        shutil.copyfile(out / f"{name}.png", ROOT / "docs" / "pictures" / f"benchmarks-{name}.png")
    PAGE.write_text(page, "utf-8")


def fill_section(page: str, name: str, text: str) -> str:
    """Return the page with `text` between the marks of a name; raise ValueError without marks."""
    begin = f"<!-- begin {name} -->\n"
    end = f"<!-- end {name} -->\n"
    if begin not in page or end not in page:
        raise ValueError(f"{PAGE.name} has no marks {begin.strip()} and {end.strip()}")
    return re.sub(f"{begin}.*?{end}", lambda match: begin + text + end, page, flags=re.DOTALL)


if __name__ == "__main__":
    main()
