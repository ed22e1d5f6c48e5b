"""A study as an RO-Crate: who made it, what it holds, how it came about, with which versions.

Sources: RO-Crate Metadata Specification 1.1; Process Run Crate 0.5.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from mimetypes import MimeTypes
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

from baldwinlab.api.export.extra import require_extra
from baldwinlab.api.export.table import KEY, Table
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import is_local, write_atomically
from baldwinlab.core.output_paths import require_writable
from baldwinlab.papers import of_study
from baldwinlab.studies.store import StudyStore

if TYPE_CHECKING:
    from rocrate.model import ContextEntity
    from rocrate.rocrate import ROCrate

FILE: Final = "ro-crate-metadata.json"
# The start of a sentence in every crate that baldwinlab has written, also by `baldwinlab crate`.
MARK: Final = "Described by `baldwinlab "
PROFILE: Final = "https://w3id.org/ro/wfrun/process/0.5"
FORMATS: Final = {
    ".toml": "application/toml",
    ".jsonl": "application/jsonl",
    ".parquet": "application/vnd.apache.parquet",
}
FOLDERS: Final = {
    "assays": "what assays measured, netCDF",
    "figures": "the report's figures, and their numbers",
    "multiverse": "the claims under every variant of the paper, a study of its own",
    "paper": "the paper that made the study: its conditions and claims",
    "parts": "sources of foreign parts, by which agents lived",
}
UNLICENSED: Final = {
    "name": "no license has been given",
    "description": "Whoever made this study has not said how it may be used.",
}
LIBRARIES: Final = {  # by what records call them
    "python": ("Python", "https://www.python.org"),
    "numpy": ("NumPy", "https://numpy.org"),
    "numba": ("Numba", "https://numba.pydata.org"),
}


def write_crate(
    study: StudyStore, authors: Sequence[str] = (), license: str = "", *, force: bool = False
) -> Path:
    """Write ro-crate-metadata.json into the directory of a study.

    Parameters
    ----------
    study
        The directory of the study.
    authors
        Names, each optionally followed by the address of an ORCID.
    license
        An address, or an SPDX name such as "CC-BY-4.0"; none, unless given.
    force
        Overwrite a file that this function did not write.

    Returns
    -------
    pathlib.Path
        The path of the file.

    Raises
    ------
    RefusedError
        An author or the license is not valid, a library is missing, or the file was written by
        another program.
    StudyError
        No run is stored, or a record is damaged.
    """
    with require_extra("an RO-Crate"):
        from rocrate.rocrate import ROCrate
    path = study.directory / FILE
    if is_local(path):
        require_writable("crate", path, MARK.encode(), force=force)
    licensed, table = _address_of(license), Table(study)
    crate = ROCrate(version="1.1")
    people = [_add(crate, *_person(author)) for author in authors]
    root = crate.root_dataset
    runs = {name: len(study.runs(name)) for name in study.experiments}
    root["name"] = study.directory.resolve().name
    root["description"] = (
        f"A study of evolution x lifetime learning; conditions: {len(runs):,}, runs: {sum(runs.values()):,}, seed: {study.seed}. "
        f"{MARK}export --format ro-crate`."
    )
    root["license"] = _add(
        crate,
        licensed or "#unlicensed",
        "CreativeWork",
        {"name": license} if license else UNLICENSED,
    )
    root["conformsTo"] = _add(
        crate, PROFILE, "CreativeWork", {"name": "Process Run Crate", "version": "0.5"}
    )
    root["variableMeasured"] = _plain([_add(crate, *each) for each in _variables(table)])
    if people:
        root["author"] = _plain(people)
    if study.paper:
        root["citation"] = _add(crate, *_article(study))
    for entry in sorted(study.directory.iterdir()):
        _describe(crate, entry)
    root["mentions"] = _action(crate, study, runs, people)
    content = json.dumps(crate.metadata.generate(), indent=1, ensure_ascii=False)
    return write_atomically(path, f"{content}\n".encode())


def _add(crate: ROCrate, identifier: str, kind: str, properties: dict[str, Any]) -> ContextEntity:
    from rocrate.model import ContextEntity

    return crate.add(ContextEntity(crate, identifier, properties={"@type": kind, **properties}))


def _plain(entities: Sequence[Any]) -> Any:
    """One stands for itself: so the specification wishes it."""
    return entities[0] if len(entities) == 1 else list(entities)


def _address_of(license: str) -> str:
    """Raises RefusedError for what is neither an address nor may be a name of SPDX."""
    if not license or re.fullmatch(r"https?://\S+", license):
        return license
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9.+-]*", license):
        raise RefusedError(
            f"--license {license} must be an address, https://..., or a name of SPDX such as CC-BY-4.0"
        )
    return f"https://spdx.org/licenses/{license}"


def _person(author: str) -> tuple[str, str, dict[str, Any]]:
    name, _, last = author.strip().rpartition(" ")
    if not last.startswith("https://orcid.org/"):
        name, last = author.strip(), f"#{quote(author.strip())}"
    if not name:
        raise RefusedError(
            f"--author {author} must have a name, which the address of an ORCID may follow"
        )
    return last, "Person", {"name": name}


def _variables(table: Table) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """What is recorded of each agent, with its unit."""
    for column in table.columns:
        if column.name not in KEY and not column.values:
            unit = {"unitText": column.unit} if column.unit else {}
            yield (
                f"#variable-{column.name}",
                "PropertyValue",
                {"name": column.name, "description": column.meaning, **unit},
            )


def _article(study: StudyStore) -> tuple[str, str, dict[str, Any]]:
    about = of_study(study.directory, study.paper).metadata
    told = {"name": about.title, "creditText": about.citation, "datePublished": str(about.year)}
    return about.link or f"#{about.name}", "ScholarlyArticle", told


def _describe(crate: ROCrate, entry: Path) -> None:
    """What else lies in the folder; runs are those of the action."""
    if entry.is_dir() and entry.name in FOLDERS:
        crate.add_dataset(
            dest_path=f"{entry.name}/",
            properties={"name": entry.name, "description": FOLDERS[entry.name]},
        )
    elif entry.is_file() and entry.name != FILE and not entry.name.startswith("."):
        _add_file(crate, entry.name)


def _add_file(crate: ROCrate, place: str) -> Any:
    kind = FORMATS.get(Path(place).suffix) or MimeTypes(()).guess_type(place)[0]
    return crate.add_file(
        dest_path=place, properties={"name": place, **({"encodingFormat": kind} if kind else {})}
    )


def _action(
    crate: ROCrate, study: StudyStore, runs: dict[str, int], people: Sequence[ContextEntity]
) -> ContextEntity:
    """From the experiments, by this software, to the runs."""
    experiments, folders = [], []
    for name, count in runs.items():
        experiments.append(_add_file(crate, f"runs/{name}/experiment.toml"))
        told = {
            "name": name,
            "description": f"runs: {count:,}; netCDF 3",
            "encodingFormat": "application/x-netcdf",
        }
        folders.append(crate.add_dataset(dest_path=f"runs/{name}/", properties=told))
    told = {
        "name": "the runs",
        "description": "each experiment, run by run: founders, lives, selection and children",
    }
    action = _add(crate, "#the-runs", "CreateAction", told | _times(study))
    action["instrument"] = _plain([*_software(crate, study)])
    action["object"] = _plain(experiments)
    action["result"] = _plain(
        [folder for folder, count in zip(folders, runs.values(), strict=True) if count]
    )
    if people:
        action["agent"] = _plain(people)
    return action


def _times(study: StudyStore) -> dict[str, str]:
    """When the first session began and the last ended, as far as any is noted."""
    spans = []
    for one in study.sessions():
        with suppress(KeyError, TypeError, ValueError):  # a line of another kind
            spans.append(
                (
                    datetime.fromisoformat(one["began"]).astimezone(UTC),
                    timedelta(seconds=one["seconds"]),
                )
            )
    if not spans:
        return {}
    began, ended = min(began for began, _ in spans), max(began + lasted for began, lasted in spans)
    return {
        "startTime": began.isoformat(timespec="seconds"),
        "endTime": ended.isoformat(timespec="seconds"),
    }


def _software(crate: ROCrate, study: StudyStore) -> Iterator[ContextEntity]:
    """What the records say that made them; usually one version of all."""
    names = ("baldwinlab", "platform", *LIBRARIES)
    runs = ((name, run) for name in study.experiments for run in study.runs(name))
    made = (study.attributes(name, run) for name, run in runs)
    for said in map(
        dict,
        dict.fromkeys(
            tuple((name, str(attributes.get(name, "unknown"))) for name in names)
            for attributes in made
        ),
    ):
        needs = [
            _add(
                crate,
                f"#{key}-{said[key]}",
                "SoftwareApplication",
                {"name": title, "url": url, "softwareVersion": said[key]},
            )
            for key, (title, url) in LIBRARIES.items()
        ]
        told = {
            "name": "baldwinlab",
            "softwareVersion": said["baldwinlab"],
            "operatingSystem": said["platform"],
        }
        application = _add(
            crate, f"#baldwinlab-{quote('-'.join(said.values()))}", "SoftwareApplication", told
        )
        application["softwareRequirements"] = needs
        yield application
