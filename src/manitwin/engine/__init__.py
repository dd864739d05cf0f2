"""Tasks, stages, driver, ledger, executors: how work is done, whatever it is."""
