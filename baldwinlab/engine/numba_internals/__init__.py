"""All private and undocumented names of Numba, llvmlite and numba-cuda that baldwinlab uses.

No other module may use such a name. A minor release of Numba may change any of them, so
`tests/engine/test_numba_internals.py` checks each one by name, and
`engine/__init__.py` bounds the versions. The modules:

- `lowering`: types, data models and LLVM instructions for code that the engine emits itself,
- `pipeline`: the passes of a compilation, the results, and how LLVM optimizes and links them,
- `dispatchers`: options of `numba.njit`, the cache protocol, and the code of a compiled function,
- `cuda`: the compilation for a GPU.
"""
