"""Fingerprints of functions, and hashes of source files, which together identify compiled code.

A fingerprint identifies a function in memory, in the cache and during compilation. A hash of a
source file ignores comments and docstrings. Compiled code contains functions from the modules of
the chosen parts, and from all modules that these import, directly or indirectly. So `hash_modules`
follows the imports inside the package. A change of another module, for example of another learning
rule, does not change the hash.

The hash of a file is the same for all versions of Python. The computation takes 10 ms per file, so
results are stored: in the package for the shipped entry points (`STORED`), and in the cache for all
other files. A stored result belongs to a file with the same bytes.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import io
import json
import tokenize
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.core.file_writing import write_atomically

PACKAGE: Final = Path(__file__).parents[1]
COMPILED_PACKAGES: Final = ("engine", "evolution", "models", "parts")
"""The packages with compiled code. Constants from other packages are part of `fingerprint`."""
COMPILER: Final = "baldwinlab.engine.jit"
"""The module that compiles all entry points."""
STORED: Final = Path(__file__).parent / "entry_points" / "sources.json"
MAX_STORED: Final = 2000
"""Maximum number of source files with a result in the cache."""

_LAYOUT: Final = {tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
_NO_CODE: Final = {*_LAYOUT, tokenize.COMMENT, tokenize.ENCODING, tokenize.ENDMARKER}
# A flag since Python 3.14. Before, the first constant of a function is the docstring or None.
_HAS_DOCSTRING: Final = getattr(inspect, "CO_HAS_DOCSTRING", None)


def fingerprint(functions: Iterable[Callable[..., Any]]) -> str:
    """Hash the code and constants of functions in memory, and of all functions that they call."""
    digest = hashlib.sha256()
    for value in reach(functions):
        for piece in _describe(value, _code_pieces):
            digest.update(piece.encode() + b"\0")
    return digest.hexdigest()[:16]


def name_fingerprint(functions: Sequence[Callable[..., Any]]) -> str:
    """Hash the names of functions in the package, and of all functions that they call.

    The hash is the same for all versions of Python. It identifies functions only if the sources are
    equal. For a function outside the package, the hash includes the code.
    """
    pieces = {piece for value in reach(functions) for piece in _describe(value, _name_pieces)}
    names = [f"{function.__module__}.{function.__qualname__}" for function in functions]
    return hashlib.sha256("\0".join([*names, *sorted(pieces)]).encode()).hexdigest()[:16]


def list_modules(functions: Iterable[Callable[..., Any]]) -> set[str]:
    """Return the names of the modules that define functions, all called functions, and parts."""
    modules: set[str] = set()
    for value in reach(functions):
        if isinstance(value, type):
            part = getattr(value, "part", None)
            classes = (*value.__mro__, *(part.__mro__ if isinstance(part, type) else ()))
            modules.update(holder.__module__ for holder in classes)
        elif isinstance(value, FunctionType):
            modules.add(value.__module__)
    return modules


def python_of(function: Any) -> Any:
    """Return the Python function of a compiled function, or the function itself."""
    return getattr(function, "py_func", function)


def reach(functions: Iterable[Any]) -> Iterator[Any]:
    """Yield functions, all functions that these call, and the types and constants in their code."""
    visited = set[int]()
    for function in functions:
        yield from _reach_value(function, visited)


def _reach_value(value: Any, visited: set[int]) -> Iterator[Any]:
    value = python_of(value)
    if isinstance(value, FunctionType):
        if id(value) not in visited:
            visited.add(id(value))
            yield value
            closure_values = [cell.cell_contents for cell in value.__closure__ or ()]
            used_values = [*_used_globals(value.__code__, value.__globals__), *closure_values]
            # The hash of the sources contains the constants of functions of the package.
            if not _is_of_package(value.__module__):
                defaults = (value.__defaults__, value.__kwdefaults__)
                used_values += [*_module_members(value.__code__, value.__globals__), *defaults]
                used_values += [*map(_describe_arrays, used_values)]
            for used in used_values:
                yield from _reach_value(used, visited)
    elif isinstance(value, type | int | float | str | bytes | tuple | np.generic):
        yield value


def _is_of_package(module: str) -> bool:
    return module.partition(".")[0] == PACKAGE.name


def _module_members(code: CodeType, namespace: Mapping[str, Any]) -> Iterator[Any]:
    """Yield the values that third-party code reads from modules, such as `settings.SPEED`."""
    spaces = [namespace]
    # A module within a package is appended to the list: `package.settings.SPEED`.
    for space in spaces:
        members = [space[name] for name in code.co_names if name in space]
        yield from members
        spaces += [
            vars(module)
            for module in members
            if isinstance(module, ModuleType)
            and not _is_of_package(module.__name__)
            and not any(vars(module) is known for known in spaces)
        ]


def _describe_arrays(value: Any) -> str:
    """Return the types, shapes and values of an array, or of the arrays in a tuple; else ""."""
    if isinstance(value, np.ndarray):
        digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return f"{value.dtype.str} {value.shape} {digest}"
    entries = value.values() if isinstance(value, dict) else value
    return "".join(map(_describe_arrays, entries)) if isinstance(value, tuple | dict) else ""


def _describe(value: Any, describe_code: Callable[[CodeType], Iterator[str]]) -> Iterator[str]:
    if isinstance(value, FunctionType):
        yield f"{value.__module__}.{value.__qualname__}"
        yield from describe_code(value.__code__)
    elif isinstance(value, type):
        # The cache of Numba identifies argument types by this name.
        yield f"{value.__module__}.{value.__qualname__}"
    else:
        yield repr(value)


def _code_pieces(code: CodeType) -> Iterator[str]:
    yield code.co_code.hex()
    yield repr(code.co_names)
    for constant in _constants(code):
        yield from _code_pieces(constant) if isinstance(constant, CodeType) else (repr(constant),)


def _constants(code: CodeType) -> tuple[Any, ...]:
    """Return the constants of a function without the docstring, which is the first constant."""
    first = code.co_consts[:1]
    is_docstring = _HAS_DOCSTRING is None or code.co_flags & _HAS_DOCSTRING
    has_docstring = bool(first) and isinstance(first[0], str) and bool(is_docstring)
    return code.co_consts[1:] if has_docstring else code.co_consts


def _name_pieces(code: CodeType) -> Iterator[str]:
    path = Path(code.co_filename)
    if path.is_relative_to(PACKAGE):
        yield path.relative_to(PACKAGE).as_posix()
    else:
        yield from _code_pieces(code)


def _used_globals(code: CodeType, namespace: dict[str, Any]) -> Iterator[Any]:
    for name in code.co_names:
        value = namespace.get(name)
        # `rng.philox` consists of the names `rng` and `philox`: the module and its function.
        if isinstance(value, ModuleType):
            members = (vars(value).get(attribute) for attribute in code.co_names)
            yield from (member for member in members if isinstance(member, FunctionType))
        elif value is not None:
            yield value
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _used_globals(constant, namespace)


class SourceFile(NamedTuple):
    """The content of a source file on which compiled code depends."""

    name: str  # Name of the module, such as "baldwinlab.engine.rng".
    code: str  # Hash of the code without comments and docstrings.
    imports: tuple[str, ...]  # Names of the imported modules with compiled code.


def hash_modules(names: Iterable[str], stored: Path | None = None) -> str:
    """Hash the code of modules and of all modules that they import.

    `stored`: file with earlier results, to which the function adds new results.
    """
    return _hash_modules(frozenset(names), stored)


@cache
def _hash_modules(names: frozenset[str], stored: Path | None) -> str:
    sources = read_sources(names, stored)
    text = "\n".join(f"{name} {sources[name].code}" for name in sorted(sources))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def read_sources(names: Iterable[str], stored: Path | None = None) -> dict[str, SourceFile]:
    """Return the sources of modules, the compiler and all imported modules, by name of module."""
    known = _read_known(STORED) | (_read_known(stored) if stored else {})
    n_known = len(known)
    sources: dict[str, SourceFile] = {}
    waiting = [COMPILER, *names]
    while waiting:
        name = waiting.pop()
        if name not in sources and (path := find_module(name)):
            key, content = _read_file(path)
            if key not in known:
                known[key] = parse_source(name, content)
            sources[name] = known[key]
            waiting += known[key].imports
    # The newest results are the last entries of `known`.
    if stored and len(known) > n_known:
        _write_known(stored, dict([*known.items()][-MAX_STORED:]))
    return sources


@cache
def hash_files() -> str:
    """Hash the bytes of all source files of compiled code."""
    digest = hashlib.sha256()
    for name in COMPILED_PACKAGES:
        for path in sorted((PACKAGE / name).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def write_sources(file: Path, names: Iterable[str]) -> None:
    """Write the sources of modules, the compiler and all imported modules to `file`."""
    sources = read_sources(names)
    paths = {name: find_module(name) for name in sorted(sources)}
    known = {_read_file(path)[0]: sources[name] for name, path in paths.items() if path}
    _write_known(file, known)


@cache
def _read_known(path: Path) -> dict[str, SourceFile]:
    """Return stored sources by the hash of the bytes of the source file."""
    # A file that is missing or damaged counts as a file without results.
    with suppress(OSError, ValueError, TypeError, AttributeError):
        entries: dict[str, Any] = json.loads(path.read_bytes())
        return {
            key: SourceFile(name, code, tuple(imports))
            for key, (name, code, imports) in entries.items()
        }
    return {}


def _write_known(path: Path, known: Mapping[str, SourceFile]) -> None:
    """Write sources, one line for each. If this fails, the next process computes them again."""
    lines = [f"{json.dumps(key)}: {json.dumps(source)}" for key, source in known.items()]
    with suppress(OSError):
        write_atomically(path, "{{\n{}\n}}\n".format(",\n".join(lines)).encode())
    _read_known.cache_clear()


@cache
def _read_file(path: Path) -> tuple[str, bytes]:
    """Return the hash of the bytes of a file, and the bytes."""
    content = path.read_bytes()
    return hashlib.sha256(content).hexdigest()[:32], content


@cache
def find_module(name: str) -> Path | None:
    """Return the file of a module with compiled code, or None for another name."""
    root, *parts = name.split(".")
    if root != PACKAGE.name or not parts or parts[0] not in COMPILED_PACKAGES:
        return None
    path = PACKAGE.joinpath(*parts)
    files = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in files if file.is_file()), None)


def parse_source(name: str, content: bytes) -> SourceFile:
    """Return the hash of the code of a module, and the modules that it imports."""
    text = content.decode("utf-8").replace("\r\n", "\n")
    code = hashlib.sha256(remove_comments(text).encode()).hexdigest()[:16]
    return SourceFile(name, code, tuple(sorted(set(_list_imports(ast.parse(text))))))


def _list_imports(tree: ast.AST) -> Iterator[str]:
    """Yield the imported modules with compiled code, and the packages that contain them."""
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            # An imported name can be a module.
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        for name in names:
            # An import of "a.b.c" imports the packages "a.b" and "a", too.
            while name:
                if find_module(name):
                    yield name
                name = name.rpartition(".")[0]


def remove_comments(text: str) -> str:
    """Return source code without comments, docstrings and blank lines.

    Versions of Python divide an f-string into different tokens. So the result consists of lines of
    the file. Tokens only show where comments and docstrings are.
    """
    lines = text.split("\n")
    code_rows: set[int] = set()
    for statement in _split_statements(text):
        tokens = [token for token in statement if token.type not in _NO_CODE]
        for token in statement:
            if token.type == tokenize.COMMENT:
                row, column = token.start
                lines[row - 1] = lines[row - 1][:column].rstrip()
        # A string that is a statement is a docstring.
        if any(token.type != tokenize.STRING for token in tokens):
            for token in tokens:
                code_rows.update(range(token.start[0], token.end[0] + 1))
    return "\n".join(lines[row - 1] for row in sorted(code_rows))


def _split_statements(text: str) -> Iterator[list[tokenize.TokenInfo]]:
    """Yield the tokens of each logical line."""
    statement: list[tokenize.TokenInfo] = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        statement.append(token)
        if token.type == tokenize.NEWLINE:
            yield statement
            statement = []
    # The tokens after the last logical line.
    yield statement
