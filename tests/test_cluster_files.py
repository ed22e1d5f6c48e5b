"""Test the files of examples/cluster."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import baldwinlab as bl
from baldwinlab.studies.store import StudyStore

FOLDER = Path(__file__).parents[1] / "examples" / "cluster"
# A replacement of ssh that runs the command on this machine.
LOCAL_SSH = """#!/bin/bash
test "$1" = -tt && test -n "$2" || exit 9
shift 2
exec "$@"
"""


def choose_address() -> str:
    """Return an address of the loopback network that only this process uses: its ports are free."""
    return ".".join(map(str, (127, *os.getpid().to_bytes(3))))


@pytest.mark.nightly
def test_the_script_for_ssh_stores_the_records_of_threads_and_ends_its_workers(
    tmp_path: Path,
) -> None:
    pytest.importorskip("distributed")
    programs = tmp_path / "bin"
    programs.mkdir()
    (programs / "ssh").write_text(LOCAL_SSH)
    (programs / "ssh").chmod(0o755)
    address = choose_address()
    environment = {
        **os.environ,
        "PATH": f"{programs}:{os.environ['PATH']}",
        "HOSTS": "here there",
        "WORKERS_PER_HOST": "1",
        "STUDY": "evo/A --runs 3 --set evolution.generations=2 --set lifetime.steps=50",
        "BIN": str(Path(sys.executable).parent),
        "OUT": str(tmp_path / "study"),
        "ADDRESS": address,
    }
    done = subprocess.run(
        ["bash", FOLDER / "ssh.sh"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    experiment = StudyStore(tmp_path / "study").experiment("evo/A")
    expected = bl.run(experiment, runs=3, out=tmp_path / "threads")
    actual = bl.open_study(tmp_path / "study").data()
    assert actual.identical(bl.open_study(expected.directory).data())
    with pytest.raises(ConnectionRefusedError), socket.create_connection((address, 8786)):
        pass


@pytest.mark.parametrize("name", ["slurm-one-job.sh", "slurm-jobs.sh", "jobqueue.yaml"])
def test_the_page_on_clusters_shows_the_file(name: str) -> None:
    page = (FOLDER.parents[1] / "docs" / "how-to" / "clusters.md").read_text("utf-8")
    assert f"\n{(FOLDER / name).read_text('utf-8')}```\n" in page


def test_the_objects_for_kubernetes_name_each_other() -> None:
    documents = yaml.safe_load_all((FOLDER / "kubernetes.yaml").read_text("utf-8"))
    objects = {(entry["kind"], entry["metadata"]["name"]): entry for entry in documents}
    pods = {
        name: entry["spec"]["template"]
        for name, entry in objects.items()
        if name[0] != "Service" and "template" in entry["spec"]
    }
    assert {name[1] for name in pods} == {"scheduler", "workers", "study"}
    service = objects["Service", "scheduler"]["spec"]
    labels = pods["Deployment", "scheduler"]["metadata"]["labels"]
    assert service["selector"] == labels
    for template in pods.values():
        (container,) = template["spec"]["containers"]
        assert container["image"] == "REGISTRY/foragers"
        mounted = {mount["name"] for mount in container.get("volumeMounts", ())}
        volumes = {
            volume["name"]: volume["persistentVolumeClaim"]["claimName"]
            for volume in template["spec"].get("volumes", ())
        }
        assert mounted == volumes.keys()
        assert all(("PersistentVolumeClaim", claim) in objects for claim in volumes.values())
    port = service["ports"][0]["port"]
    for name in (("Deployment", "workers"), ("Job", "study")):
        command = pods[name]["spec"]["containers"][0]["command"]
        assert any(str(word).endswith(f"tcp://scheduler:{port}") for word in command)
