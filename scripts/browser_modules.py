"""Compile the WebAssembly modules of the package: about seven minutes.

Run the script after every change of compiled code: a test fails until then.
It needs a linker: see docs/how-to/export-page.md.
"""

import json
import platform

from baldwinlab.models.miniworld.backends.wasm_modules import (
    FINGERPRINTS,
    MODULES_FOLDER,
    compile_modules,
    module_hash,
    shipped_experiments,
)


def main() -> None:
    MODULES_FOLDER.mkdir(exist_ok=True)
    experiments = shipped_experiments()
    marks = {name: module_hash(experiment) for name, experiment in experiments.items()}
    for name, module in zip(experiments, compile_modules(experiments.values()), strict=True):
        (MODULES_FOLDER / f"{name}.wasm").write_bytes(module)
        print(f"{name}: {len(module):,} bytes, made of {marks[name]}")
    version = ".".join(platform.python_version_tuple()[:2])
    fingerprints = {"python": version, "marks": marks}
    FINGERPRINTS.write_text(json.dumps(fingerprints, indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    main()
