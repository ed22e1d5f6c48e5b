"""A grammar of hostile parts: files that misbehave when they are imported or declared."""

from __future__ import annotations

import random

IMPORTS = "from baldwinlab.parts import Field, LearningRule, get, put\n"
# Statements after which no file can be loaded.
ERRORS = [
    "raise ValueError('boom')",
    "raise SystemExit(0)",
    "raise KeyboardInterrupt",
    "raise GeneratorExit",
    "raise type('E', (BaseException,), {})('\\x1b[31mred')",
    "import sys; sys.exit(0)",
    "import sys; sys.exit('text')",
    "1 / 0",
    "import no_such_module",
    "from baldwinlab.parts import NoSuchName",
    "assert False",
    "raise ImportError",
    "f = lambda n: f(n + 1)\nf(0)",
    "raise UnicodeDecodeError('utf-8', b'x', 0, 1, '\\u202e')",
    "x = [",
    "def f(:",
    "\tx = 1\n  y = 2",
    "raise RuntimeError('a' * 100_000)",
    "raise OSError(2, 'No such file', 'a\\nb')",
]
# Declarations that only some commands refuse.
DECLARATIONS = [
    "class P(LearningRule, name='\\x1b[2J'): pass",
    "class P(LearningRule, name=5): pass",
    "class P(LearningRule, name=''): pass",
    "class P(LearningRule, name='a/b'): pass",
    "class P(LearningRule): pass",
    "class P(LearningRule, name='hebb', no_such_option=1): pass",
    "class P(LearningRule, name='p'):\n    rate: float = Field(0.1, ge=5)",
    "class P(LearningRule, name='p'):\n    rate: object = 1",
    "class P(LearningRule, name='p'):\n    initialize = 5",
    "class P(LearningRule, name='p'): pass\nclass Q(LearningRule, name='p'): pass",
]
# Statements after which a file can still end normally.
EFFECTS = [
    "print('noise')",
    "import os; os.chdir('/')",
    "import numpy; numpy.random.seed(0)",
    "import threading; threading.Thread(target=print, args=('thread',)).start()",
    "import sys; sys.stdout.write('noise')",
    "import sys; sys.setrecursionlimit(80)",
    "import warnings; warnings.warn('\\x1b[31mnoise')",
    "",
]


def write_part(choice: random.Random) -> tuple[bytes, bool]:
    """Return the content of a file, and whether it must be refused."""
    is_error = choice.random() < 0.7
    statement = choice.choice(ERRORS if is_error else DECLARATIONS)
    content = "\n".join([IMPORTS, choice.choice(EFFECTS), statement, choice.choice(EFFECTS)])
    ends = [b""] * 8 + [b"\xff", b"\x00"]
    return content.encode() + choice.choice(ends), is_error
