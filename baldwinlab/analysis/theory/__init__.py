"""Laws of learning and evolution: closed forms and balances, without a simulation.

Each module has the laws of one model or mechanism. `docs/explanation/laws.md` derives them.
"""
