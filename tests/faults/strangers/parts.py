"""A grammar of hostile parts: files that misbehave when they are imported, declared or executed."""

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
# Statements of hooks that end a simulation.
HOOK_ERRORS = [
    "raise ValueError('boom')",
    "raise SystemExit(0)",
    "raise GeneratorExit",
    "raise type('E', (BaseException,), {})('\\x1b[31mred')",
    "assert False, '\\u202e'",
    "state.generation[10**9] = 0",
    "state.no_such_array[0] = 1",
    "part.no_such_setting + 1",
    "1 // 0",
    "[0][len(part) + 1]",
    "part = part.rate + 'text'",
    "part()",
    "fail(part, model, state, step, lane)",
]
# Places from which the package calls the function `fail` of a rule.
HOOKS = [
    "learn = staticmethod(fail)",
    "derived = {'n': lambda part, experiment: fail(part, experiment)}",
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
    "import numpy; numpy.seterr(all='raise')",
    "import numpy; numpy.set_printoptions(precision=1)",
    "import random; random.seed(0)",
    "import os; os.environ['COLUMNS'] = '5'",
    "import os; os.umask(0o777)",
    "import os; os.close(1)",
    "import os; os.write(1, b'noise')",
    "import sys; sys.stdout = None",
    "import sys; sys.stdout.close()",
    "import sys; sys.path.clear()",
    "import sys; sys.argv.clear()",
    "import sys; sys.excepthook = None",
    "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)",
    "import gc; gc.disable()",
    "import locale; locale.setlocale(locale.LC_ALL, 'C')",
    "import atexit; atexit.register(exit)",
    "import subprocess; subprocess.Popen(['sleep', '0.1'])",
    "import os\nif os.fork() == 0: os._exit(3)",
    "open('file-of-the-part', 'w').close()",
    "",
]


def write_part(choice: random.Random) -> tuple[bytes, bool]:
    """Return a file that fails or misbehaves when it is loaded, and whether it must be refused."""
    is_error = choice.random() < 0.7
    statement = choice.choice(ERRORS if is_error else DECLARATIONS)
    content = "\n".join([IMPORTS, choice.choice(EFFECTS), statement, choice.choice(EFFECTS)])
    ends = [b""] * 8 + [b"\xff", b"\x00"]
    return content.encode() + choice.choice(ends), is_error


def write_rule(choice: random.Random) -> bytes:
    """Return a file with the learning rule "stranger", which fails in a simulation."""
    return f"""{IMPORTS}
{choice.choice(EFFECTS)}

def fail(part, model, state=None, step=0, lane=0):
    {choice.choice(HOOK_ERRORS)}

class Rule(LearningRule, name="stranger"):
    {choice.choice(HOOKS)}
""".encode()
