"""Execution engine: tasks, stages, driver, ledger and executors. It is independent of what the stages compute."""
