"""Describe a study as an RO-Crate: authors, content, simulations and software versions.

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

from baldwinlab.api.export.formats import ExportFormat, Option
from baldwinlab.api.export.table import KEY_COLUMNS, StudyTable
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import is_local, list_names, require_writable, shorten_path
from baldwinlab.papers import load_stored_paper
from baldwinlab.studies.store import StudyStore

if TYPE_CHECKING:
    from rocrate.model import ContextEntity
    from rocrate.rocrate import ROCrate

CRATE_FILE: Final = "ro-crate-metadata.json"
# Text in every crate that baldwinlab has written.
CRATE_MARK: Final = "Described by `baldwinlab "
PROFILE_ADDRESS: Final = "https://w3id.org/ro/wfrun/process/0.5"
MEDIA_TYPES: Final = {
    ".toml": "application/toml",
    ".jsonl": "application/jsonl",
    ".parquet": "application/vnd.apache.parquet",
}
FOLDER_DESCRIPTIONS: Final = {
    "assays": "results of the assays, netCDF",
    "figures": "figures of the report and their numbers",
    "multiverse": "claims under every variant of the paper, as a separate study",
    "paper": "the paper that defines the study: its conditions and claims",
    "parts": "sources of the third-party parts",
}
"""Descriptions of the folders of a study."""
NO_LICENSE: Final = {
    "name": "no license has been given",
    "description": "The authors of this study have not chosen a license.",
}
LIBRARIES: Final = {
    "python": ("Python", "https://www.python.org"),
    "numpy": ("NumPy", "https://numpy.org"),
    "numba": ("Numba", "https://numba.pydata.org"),
}
"""(title, address) of a library, by the attribute of a record with the version."""
Properties = dict[str, Any]
Entity = tuple[str, str, Properties]
"""Identifier, type and properties of an entity."""


def write_crate(
    study: StudyStore,
    path: None = None,
    *,
    author: Sequence[str] = (),
    license: str = "",
    force: bool = False,
) -> str:
    """Write ro-crate-metadata.json into the directory of a study; return the path as text."""
    from rocrate.rocrate import ROCrate

    crate_path = study.directory / CRATE_FILE
    if is_local(crate_path):
        require_writable("crate", crate_path, CRATE_MARK.encode(), force=force)
    license_address = _find_license_address(license) or "#unlicensed"
    crate = ROCrate(version="1.1")
    people = [_add_entity(crate, *_parse_author(text)) for text in author]
    runs = {name: len(study.runs(name)) for name in study.experiments}
    root = crate.root_dataset
    root["name"] = study.directory.resolve().name
    root["description"] = (
        f"A study of evolution x lifetime learning; conditions: {len(runs):,}, "
        f"runs: {sum(runs.values()):,}, seed: {study.seed}. {CRATE_MARK}export --format ro-crate`."
    )
    license_properties = {"name": license} if license else NO_LICENSE
    root["license"] = _add_entity(crate, license_address, "CreativeWork", license_properties)
    profile = {"name": "Process Run Crate", "version": "0.5"}
    root["conformsTo"] = _add_entity(crate, PROFILE_ADDRESS, "CreativeWork", profile)
    variables = [_add_entity(crate, *variable) for variable in _list_variables(StudyTable(study))]
    root["variableMeasured"] = _unwrap_single(variables)
    if people:
        root["author"] = _unwrap_single(people)
    if study.paper:
        root["citation"] = _add_entity(crate, *_describe_article(study))
    for name in sorted(list_names(study.directory)):
        _add_entry(crate, study.directory / name)
    root["mentions"] = _add_action(crate, study, runs, people)
    content = json.dumps(crate.metadata.generate(), indent=1, ensure_ascii=False)
    write_atomically(crate_path, f"{content}\n".encode())
    return f"RO-Crate: {shorten_path(crate_path)}"


def _add_entity(
    crate: ROCrate, identifier: str, kind: str, properties: Properties
) -> ContextEntity:
    from rocrate.model import ContextEntity

    return crate.add(ContextEntity(crate, identifier, properties={"@type": kind, **properties}))


def _unwrap_single(entities: Sequence[Any]) -> Any:
    """Return the list, or the only entity of the list, as the specification requires."""
    return entities[0] if len(entities) == 1 else list(entities)


def _find_license_address(license: str) -> str:
    """Return the address of a license. Raise RefusedError for an invalid address or name."""
    if not license or re.fullmatch(r"https?://\S+", license):
        return license
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9.+-]*", license):
        raise RefusedError(
            f"--license {license} must be an address, https://..., or an SPDX name such as "
            "CC-BY-4.0"
        )
    return f"https://spdx.org/licenses/{license}"


def _parse_author(author: str) -> Entity:
    """Return a person from "NAME ADDRESS" or "NAME". ADDRESS, of an ORCID, is the identifier."""
    name, _, address = author.strip().rpartition(" ")
    if not address.startswith("https://orcid.org/"):
        name = author.strip()
        address = f"#{quote(name)}"
    if not name:
        raise RefusedError(
            f"--author {author} must have a name, which the address of an ORCID may follow"
        )
    return address, "Person", {"name": name}


def _list_variables(table: StudyTable) -> Iterator[Entity]:
    """Yield the recorded variables of an agent, with their units."""
    for column in table.columns:
        if column.name not in KEY_COLUMNS and not column.categories:
            properties = {"name": column.name, "description": column.meaning}
            if column.unit:
                properties["unitText"] = column.unit
            yield f"#variable-{column.name}", "PropertyValue", properties


def _describe_article(study: StudyStore) -> Entity:
    """Return the article of the study's paper."""
    metadata = load_stored_paper(study.directory, study.paper).metadata
    properties = {
        "name": metadata.title,
        "creditText": metadata.citation,
        "datePublished": str(metadata.year),
    }
    return metadata.link or f"#{metadata.name}", "ScholarlyArticle", properties


def _add_entry(crate: ROCrate, entry: Path) -> None:
    """Add a file or a folder of the study. `_add_action` adds the runs."""
    if entry.is_dir() and entry.name in FOLDER_DESCRIPTIONS:
        crate.add_dataset(
            dest_path=f"{entry.name}/",
            properties={"name": entry.name, "description": FOLDER_DESCRIPTIONS[entry.name]},
        )
    elif entry.is_file() and entry.name != CRATE_FILE and not entry.name.startswith("."):
        _add_file(crate, entry.name)


def _add_file(crate: ROCrate, path: str) -> Any:
    """Add a file of the study, with its media type if the type is known."""
    properties = {"name": path}
    standard_type, _ = MimeTypes(()).guess_type(path)
    media_type = MEDIA_TYPES.get(Path(path).suffix) or standard_type
    if media_type:
        properties["encodingFormat"] = media_type
    return crate.add_file(dest_path=path, properties=properties)


def _add_action(
    crate: ROCrate, study: StudyStore, runs: dict[str, int], people: Sequence[ContextEntity]
) -> ContextEntity:
    """Add the simulation. The experiments are the input, and the runs are the result."""
    experiments = []
    folders = []
    for name, count in runs.items():
        experiments.append(_add_file(crate, f"runs/{name}/experiment.toml"))
        folder_properties = {
            "name": name,
            "description": f"runs: {count:,}; netCDF 3",
            "encodingFormat": "application/x-netcdf",
        }
        folder = crate.add_dataset(dest_path=f"runs/{name}/", properties=folder_properties)
        if count:
            folders.append(folder)
    properties = {
        "name": "the runs",
        "description": "simulates each run: founders, lifetimes, selection and offspring",
    }
    action = _add_entity(crate, "#the-runs", "CreateAction", properties | _session_times(study))
    action["instrument"] = _unwrap_single([*_add_software(crate, study)])
    action["object"] = _unwrap_single(experiments)
    action["result"] = _unwrap_single(folders)
    if people:
        action["agent"] = _unwrap_single(people)
    return action


def _session_times(study: StudyStore) -> dict[str, str]:
    """Return the start of the first session and the end of the last session, if any is recorded."""
    starts = []
    ends = []
    for session in study.sessions():
        # Skip a line that is not a session.
        with suppress(KeyError, TypeError, ValueError):
            start = datetime.fromisoformat(session["began"]).astimezone(UTC)
            ends.append(start + timedelta(seconds=session["seconds"]))
            starts.append(start)
    if not starts:
        return {}
    return {
        "startTime": min(starts).isoformat(timespec="seconds"),
        "endTime": max(ends).isoformat(timespec="seconds"),
    }


def _add_software(crate: ROCrate, study: StudyStore) -> Iterator[ContextEntity]:
    """Add the software versions in the records. Usually all records have the same version."""
    names = ("baldwinlab", "platform", *LIBRARIES)
    # The runs of a file have the same versions, so the first run is enough.
    files = ((name, file) for name in study.experiments for file in study.files(name))
    records = (study.attributes(name, file.first) for name, file in files)
    versions = (tuple(str(record.get(name, "unknown")) for name in names) for record in records)
    for values in dict.fromkeys(versions):
        software = dict(zip(names, values, strict=True))
        libraries = []
        for key, (title, url) in LIBRARIES.items():
            library = {"name": title, "url": url, "softwareVersion": software[key]}
            identifier = f"#{key}-{software[key]}"
            libraries.append(_add_entity(crate, identifier, "SoftwareApplication", library))
        properties = {
            "name": "baldwinlab",
            "softwareVersion": software["baldwinlab"],
            "operatingSystem": software["platform"],
        }
        identifier = f"#baldwinlab-{quote('-'.join(values))}"
        application = _add_entity(crate, identifier, "SoftwareApplication", properties)
        application["softwareRequirements"] = libraries
        yield application


FORMAT: Final = ExportFormat(
    name="ro-crate",
    content="metadata of the study, written into its folder: authors, license, files, versions",
    write=write_crate,
    options=(
        Option(
            "author",
            list[str],
            "name of an author, optionally followed by the address of an ORCID. Repeat the option "
            "for several authors.",
        ),
        Option(
            "license", str, "license of the study, an address or an SPDX name such as CC-BY-4.0."
        ),
    ),
    library="rocrate.rocrate",
    extra="exchange",
    output="none",
    uses_parts=True,
)
