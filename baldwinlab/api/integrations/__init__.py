"""Use experiments with external optimizers and reinforcement learning libraries."""
