"""Write results into the page of the atlas: `python -m scripts.atlas_page FOLDER [FOLDER ...]`.

Each FOLDER is the folder of `baldwinlab reproduce atlas`, each with another seed. The estimates,
the laws and the picture are those of the first folder.
"""

import json
import shutil
import sys
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from scripts.pages import EXPLANATION, PICTURES, tabulate, write_results

PAGE: Final = EXPLANATION / "atlas.md"
PICTURE: Final = PICTURES / "atlas.png"
# Heading of the article above the table that compares the laws.
LAWS: Final = "### Residual learning and the laws\n"


def read_claims(folder: Path) -> list[dict[str, Any]]:
    """Return the results of all claims."""
    claims: list[dict[str, Any]] = json.loads((folder / "claims.json").read_text("utf-8"))
    return claims


def read_seed(folder: Path) -> int:
    """Return the seed of an atlas."""
    return int(tomllib.loads((folder / "needle" / "sweep.toml").read_text("utf-8")).get("seed", 0))


def describe_kind(claim: Mapping[str, Any]) -> str:
    """Return whether a claim is a conjecture, or the reason why it is nearly a theorem."""
    return f"near-theorem: {claim['near_theorem']}" if claim["near_theorem"] else "conjecture"


def count_equal(by_folder: Sequence[Sequence[Mapping[str, Any]]]) -> str:
    """Return how many verdicts are equal for all seeds, as a sentence, or "" for one seed."""
    if len(by_folder) == 1:
        return ""
    verdicts = [{claim["verdict"] for claim in claims} for claims in zip(*by_folder, strict=True)]
    n_equal = sum(len(values) == 1 for values in verdicts)
    return f"{n_equal} of {len(verdicts)} verdicts are equal for all seeds."


def make_results(folders: list[Path]) -> str:
    """Return the verdicts of all folders, and the estimates and laws of the first one."""
    by_folder = [read_claims(folder) for folder in folders]
    seeds = [read_seed(folder) for folder in folders]
    verdicts = [
        [
            f"{claims[0]['id']}: {claims[0]['claim']}",
            describe_kind(claims[0]),
            claims[0]["registered_verdict"],
            *(claim["verdict"] for claim in claims),
        ]
        for claims in zip(*by_folder, strict=True)
    ]
    columns = ["claim", "kind", "registered rule, seed 0", *(f"seed {seed}" for seed in seeds)]
    estimates = [[claim["id"], claim["numbers"]] for claim in by_folder[0]]
    article = (folders[0] / "article.md").read_text("utf-8")
    laws = article.split(LAWS)[1].split("![")[0].strip()
    runs = min(claim["runs"] for claims in by_folder for claim in claims)
    return "\n".join(
        [
            f"Confirmatory runs per cell: {runs}. {count_equal(by_folder)}".rstrip(),
            "",
            *tabulate(columns, verdicts),
            "",
            f"The estimates of seed {seeds[0]}:",
            "",
            *tabulate(["claim", "estimates with 95 % intervals, limits and verdicts"], estimates),
            "",
            laws,
            "",
            f"![Measured residual learning against the laws](../pictures/{PICTURE.name})",
        ]
    )


if __name__ == "__main__":
    given = [Path(argument) for argument in sys.argv[1:]]
    write_results(PAGE, make_results(given))
    shutil.copy(given[0] / "figures" / "laws.png", PICTURE)
